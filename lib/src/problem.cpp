#include <costate/error.hpp>
#include <costate/problem.hpp>

#include <fmt/format.h>

namespace costate {

Eigen::Index Problem::place_of(const std::string& unknown) const {
  std::string known;
  for (std::size_t i = 0; i < unknowns_.size(); ++i) {
    if (unknowns_[i].name == unknown) return static_cast<Eigen::Index>(i);
    known += (known.empty() ? "" : ", ") + unknowns_[i].name;
  }
  throw BadInput(fmt::format("the problem has no unknown '{}'; it has {}", unknown, known));
}

Eigen::VectorXd Problem::start() const {
  Eigen::VectorXd y(static_cast<Eigen::Index>(unknowns_.size()));
  for (std::size_t i = 0; i < unknowns_.size(); ++i) y[static_cast<Eigen::Index>(i)] = unknowns_[i].guess;
  return y;
}

}  // namespace costate
