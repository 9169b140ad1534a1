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

Jet Jet::merge(const Jet& a, const Jet& b, double f, double fa, double fb) {
  const auto same = [](const Entry& x, const Entry& y) { return x.column == y.column; };
  if (std::equal(a.gradient_.begin(), a.gradient_.end(), b.gradient_.begin(), b.gradient_.end(), same)) {
    Jet r(f);
    Entry* to = r.gradient_.extend(a.gradient_.size());
    const Entry* other = b.gradient_.begin();
    for (const Entry& entry : a.gradient_) {
      to->column = entry.column;
      to++->derivative = fa * entry.derivative + fb * (other++)->derivative;
    }
    return r;
  }
  Jet r(f);
  const Entry *i = a.gradient_.begin(), *j = b.gradient_.begin();
  const Entry *const i_end = a.gradient_.end(), *const j_end = b.gradient_.end();
  while (i != i_end && j != j_end) {
    if (i->column == j->column) {
      r.gradient_.push_back({i->column, fa * i->derivative + fb * j->derivative});
      ++i;
      ++j;
    } else if (i->column < j->column) {
      r.gradient_.push_back({i->column, fa * i->derivative});
      ++i;
    } else {
      r.gradient_.push_back({j->column, fb * j->derivative});
      ++j;
    }
  }
  for (; i != i_end; ++i) r.gradient_.push_back({i->column, fa * i->derivative});
  for (; j != j_end; ++j) r.gradient_.push_back({j->column, fb * j->derivative});
  return r;
}

Jet sqrt(const Jet& a, const char* what) {
  if (!(a.value >= 0.0)) throw LeftDomain(fmt::format("{} is {:.3g}, below 0", what, a.value));
  const double root = std::sqrt(a.value);
  return Jet::chain(a, root, 0.5 / root);
}

}  // namespace costate
