/// From how many of 200 random guesses a solve arrives at a verified extremal, on two problems in their plainest
/// formulation.
#include "basin_problems.hpp"

#include <costate/shooting/solve.hpp>

#include <gtest/gtest.h>

#include <random>

namespace costate {
namespace {

constexpr int guesses = COSTATE_FEWER ? 20 : 200;

/// What the guesses lead to.
struct Basin {
  int solved = 0;
  int at_first = 0;  ///< without a second start
  double seconds = 0.0;
  std::vector<double> final_times;  ///< of those solved
};

/// t_f evenly in 0.5 … 6 s, every costate in −1 … 1.
Basin basin_of(const std::shared_ptr<const Problem>& problem) {
  std::mt19937 engine(1);
  const auto uniform = [&](double a, double b) { return a + (b - a) * (static_cast<double>(engine()) / 4294967296.0); };
  Basin basin;
  for (int i = 0; i < guesses; ++i) {
    Eigen::VectorXd guess = problem->start();
    guess[0] = uniform(0.5, 6.0);
    for (Eigen::Index j = 1; j < guess.size(); ++j) guess[j] = uniform(-1.0, 1.0);
    // A seed of its own for every guess, else one lucky draw would serve them all.
    const Solution result = solve(problem, guess, {.random = RandomStarts{.seed = static_cast<unsigned>(i + 1)}});
    basin.seconds += result.cost.seconds;
    if (!result.solved()) continue;
    ++basin.solved;
    if (result.starts == 1) ++basin.at_first;
    basin.final_times.push_back(result.final_time());
  }
  return basin;
}

TEST(Basin, DiskFromEveryGuess) {
  const Basin basin = basin_of(std::make_shared<basin::DiskTransfer>());
  RecordProperty("solved_at_first", basin.at_first);
  RecordProperty("milliseconds_each", static_cast<int>(1e3 * basin.seconds / guesses));
  EXPECT_EQ(basin.solved, guesses);
  // Every bound is at most the accuracy, 1e-8, and relative above 1.
  for (const double t : basin.final_times) EXPECT_NEAR(t, basin::DiskTransfer::final_time, 1e-8 * t);
}

TEST(Basin, DragFromEveryGuess) {
  const Basin basin = basin_of(std::make_shared<basin::DragTransfer>());
  RecordProperty("solved_at_first", basin.at_first);
  RecordProperty("milliseconds_each", static_cast<int>(1e3 * basin.seconds / guesses));
  EXPECT_EQ(basin.solved, guesses);
  for (const double t : basin.final_times) {
    EXPECT_NEAR(t, t < 1.6 ? basin::DragTransfer::final_time : basin::DragTransfer::dive_time, 1e-8 * t);
  }
}

}  // namespace
}  // namespace costate
