/// A table of the test set's problems: accuracy reached against the reference, bound claimed, segments, cost.
#include "bvp_problems.hpp"
#include "collocation.hpp"

#include <costate/shooting/solve.hpp>

#include <cstdlib>
#include <fmt/format.h>

namespace costate {
namespace {

using Values = std::vector<double>;

/// y(a) and y(b): a closed form where there is one.
template <class P>
std::pair<Values, double> reference(const std::vector<double>& parameters) {
  using F = bvp::System<P>;
  Values all;
  if constexpr (bvp::HasExact<P>) {
    for (const double x : {P::a, P::b}) {
      for (const double v : bvp::exact<P>(x, parameters.back())) all.push_back(v);
    }
    return {all, 0.0};
  } else {
    const auto r = collocation::reference<F>(parameters, 300);
    for (const auto* end : {&r.start, &r.end}) {
      for (const auto v : *end) all.push_back(static_cast<double>(v));
    }
    return {all, static_cast<double>(r.error)};
  }
}

/// One row; the last parameter is solved for, the others lead the reference there.
template <class P>
void row(const std::vector<double>& parameters, double accuracy) {
  using F = bvp::System<P>;
  const double epsilon = parameters.back();
  const std::string name = fmt::format("{:>3} {:>9.3g}", P::number, epsilon);
  Solution s;
  try {
    s = solve(bvp::statement<P>(epsilon).shared(), {.accuracy = accuracy});
  } catch (const std::exception& error) {
    fmt::print("{}  threw {}\n", name, error.what());
    return;
  }
  if (!s.solved()) {
    fmt::print("{}  {:.0f} ms  {}\n", name, 1e3 * s.cost.seconds, s.message.substr(0, 300));
    return;
  }
  try {
    const auto [known, uncertain] = reference<P>(parameters);
    double error = 0.0, bound = 0.0, excess = 0.0;
    for (std::size_t i = 0; i < known.size(); ++i) {
      const Quantity& q = s[fmt::format("{}({})", F::names[i % F::names.size()], i < F::names.size() ? F::a : F::b)];
      const double unit = std::max(1.0, std::abs(known[i]));
      const double wrong = std::max(0.0, std::abs(q.value - known[i]) - 2.0 * uncertain * unit);
      error = std::max(error, std::abs(q.value - known[i]) / unit);
      bound = std::max(bound, q.error_bound / unit);
      excess = std::max(excess, wrong / std::max(q.error_bound, 1e-300));
    }
    fmt::print(
        "{}  error {:8.1e}  bound {:8.1e}  worst error/bound {:8.1e}  reference {:7.1e}  segments {:4}  {:8.1f} ms{}\n",
        name, error, bound, excess, uncertain, s.arcs.size(), 1e3 * s.cost.seconds, excess > 1.0 ? "  ABOVE ITS BOUND" : "");
  } catch (const std::exception& failed) {
    fmt::print("{}  solved, {:.1f} ms, no reference: {}\n", name, 1e3 * s.cost.seconds, failed.what());
  }
  std::fflush(stdout);
}

template <class... P>
void rows(const std::vector<double>& parameters, double accuracy) {
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    (row<P>({parameters.begin(), parameters.begin() + static_cast<std::ptrdiff_t>(i) + 1}, accuracy), ...);
  }
}

}  // namespace
}  // namespace costate

int main(int arguments, char** values) {
  using namespace costate;
  using namespace costate::bvp;
  const double accuracy = arguments > 1 ? std::atof(values[1]) : 1e-8;
  rows<Problem1, Problem2, Problem3, Problem4, Problem5, Problem6, Problem7, Problem8, Problem9, Problem10, Problem11,
       Problem12, Problem13, Problem14, Problem15, Problem17, Problem18>({0.1, 0.01, 1e-3, 1e-4}, accuracy);
  rows<Problem16>({1.0 / 3.0, 1.0 / 11.0, 1.0 / 101.0}, accuracy);
  rows<Problem19, Problem20, Problem21, Problem22, Problem24, Problem25, Problem26, Problem27, Problem28, Problem29,
       Problem30>({0.1, 0.03, 0.01, 3e-3, 1e-3}, accuracy);
  rows<Problem23>({1.0, 3.0, 5.0, 7.0, 9.0}, accuracy);
  rows<Problem31>({0.1, 0.05, 0.02, 0.01, 5e-3}, accuracy);
  rows<Problem32>({1.0, 10.0, 100.0, 1000.0}, accuracy);
  rows<Problem33>({0.1, 0.03, 0.01, 3e-3, 1e-3}, accuracy);
  rows<Problem34>({1.0, 3.0, 4.5, 6.0}, accuracy);
  return 0;
}
