#include <costate/error.hpp>
#include <costate/jet.hpp>

#include <algorithm>
#include <fmt/format.h>

namespace costate {

double Jet::derivative(int column) const {
  const auto at = std::lower_bound(gradient_.begin(), gradient_.end(), column,
                                   [](const Entry& entry, int wanted) { return entry.column < wanted; });
  return at != gradient_.end() && at->column == column ? at->derivative : 0.0;
}

Jet Jet::chain(const Jet& a, double f, double derivative) {
  Jet r(f, a.gradient_);
  for (Entry& entry : r.gradient_) entry.derivative *= derivative;
  return r;
}

Jet Jet::chain(const Jet& a, const Jet& b, double f, double fa, double fb) {
  if (b.gradient_.empty()) return chain(a, f, fa);
  if (a.gradient_.empty()) return chain(b, f, fb);
  Gradient merged;
  merged.reserve(a.gradient_.size() + b.gradient_.size());
  auto i = a.gradient_.begin();
  auto j = b.gradient_.begin();
  while (i != a.gradient_.end() || j != b.gradient_.end()) {
    if (j == b.gradient_.end() || (i != a.gradient_.end() && i->column < j->column)) {
      merged.push_back({i->column, fa * i->derivative});
      ++i;
    } else if (i == a.gradient_.end() || j->column < i->column) {
      merged.push_back({j->column, fb * j->derivative});
      ++j;
    } else {
      merged.push_back({i->column, fa * i->derivative + fb * j->derivative});
      ++i;
      ++j;
    }
  }
  return {f, std::move(merged)};
}

Jet sqrt(const Jet& a, const char* what) {
  if (!(a.value >= 0.0)) throw LeftDomain(fmt::format("{} is {:.3g}, below 0", what, a.value));
  const double root = std::sqrt(a.value);
  return Jet::chain(a, root, 0.5 / root);
}

}  // namespace costate
