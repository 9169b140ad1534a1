/// A table of the test set's problems: accuracy reached against the reference, bound claimed, segments, cost.
#include "bvp_reference.hpp"

#include <costate/shooting/solve.hpp>

#include <cstdlib>
#include <fmt/format.h>

namespace costate {
namespace {

/// One row; the last parameter is solved for, the others lead the reference there.
template <class P>
void row(const std::vector<double>& parameters, const SolveOptions& options) {
  const double epsilon = parameters.back();
  const std::string name = fmt::format("{:>3} {:>9.3g}", P::number, epsilon);
  Solution s;
  try {
    s = solve(bvp::statement<P>(epsilon).shared(), options);
  } catch (const std::exception& error) {
    fmt::print("{}  threw {}\n", name, error.what());
    return;
  }
  if (!s.solved()) {
    fmt::print("{}  {:.0f} ms  {}\n", name, 1e3 * s.cost.seconds, s.message.substr(0, 300));
    return;
  }
  try {
    const bvp::Known known = bvp::known<P>(parameters);
    const bvp::Comparison c = bvp::compare<P>(s, known);
    const bool above = c.excess > 1.0 || c.bound > options.accuracy;
    fmt::print("{}  error {:8.1e}  bound {:8.1e}  error/bound {:8.1e}  reference {:7.1e}  segments {:4}  {:8.1f} ms{}\n",
               name, c.error, c.bound, c.excess, known.error, s.arcs.size(), 1e3 * s.cost.seconds,
               above ? "  ABOVE ITS BOUND" : "");
  } catch (const std::exception& failed) {
    fmt::print("{}  solved, {:.1f} ms, no reference: {}\n", name, 1e3 * s.cost.seconds, failed.what());
  }
  std::fflush(stdout);
}

template <class... P>
void rows(const std::vector<double>& parameters, const SolveOptions& options) {
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    (row<P>({parameters.begin(), parameters.begin() + static_cast<std::ptrdiff_t>(i) + 1}, options), ...);
  }
}

}  // namespace
}  // namespace costate

int main(int arguments, char** values) {
  using namespace costate;
  using namespace costate::bvp;
  SolveOptions options;
  if (arguments > 1) options.accuracy = std::atof(values[1]);
  if (arguments > 2) options.max_steps = std::atol(values[2]);
  if (arguments > 3) options.method = std::string(values[3]) == "bdf" ? Method::bdf : Method::adams;
  rows<Problem1, Problem2, Problem3, Problem4, Problem5, Problem6, Problem7, Problem8, Problem9, Problem10, Problem11,
       Problem12, Problem13, Problem14, Problem15, Problem17, Problem18>({0.1, 0.01, 1e-3, 1e-4}, options);
  rows<Problem16>({1.0 / 3.0, 1.0 / 11.0, 1.0 / 101.0}, options);
  rows<Problem19, Problem20, Problem21, Problem22, Problem24, Problem25, Problem26, Problem27, Problem28, Problem29,
       Problem30>({0.1, 0.03, 0.01, 3e-3, 1e-3}, options);
  rows<Problem23>({1.0, 3.0, 5.0, 7.0, 9.0}, options);
  rows<Problem31>({0.1, 0.05, 0.02, 0.01, 5e-3}, options);
  rows<Problem32>({1.0, 10.0, 100.0, 1000.0}, options);
  rows<Problem33>({0.1, 0.03, 0.01, 3e-3, 1e-3}, options);
  rows<Problem34>({1.0, 3.0, 4.5}, options);
  return 0;
}
