/// Time of the linear algebra of multiple shooting, for one arc cut into more and more segments: it should not depend on their number.
/// Prints medians of the thread's CPU time, in microseconds per segment.
#include "staircase.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <random>

namespace costate {
namespace {

double thread_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Median over repetitions of about 0.2 s in all, at least 5.
template <class Work>
double median_seconds(const Work& work) {
  std::vector<double> times;
  for (double total = 0.0; total < 0.2 || times.size() < 5; total += times.back()) {
    const double begin = thread_seconds();
    work();
    times.push_back(thread_seconds() - begin);
  }
  const auto middle = times.begin() + std::ssize(times) / 2;
  std::nth_element(times.begin(), middle, times.end());
  return *middle;
}

/// An arc of `segments` segments of `size` states that starts at the first unknowns; all rows depend on the border too.
std::vector<Jet::Gradient> chain(int border, int segments, int size) {
  std::mt19937 generator;
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<Jet::Gradient> rows;
  const auto fill = [&](Jet::Gradient& row, int first, int count) {
    for (int j = 0; j < count; ++j) row.push_back({first + j, uniform(generator)});
  };
  for (int k = 0; k < segments; ++k)
    for (int i = 0; i < size; ++i) {
      auto& row = rows.emplace_back();
      fill(row, 0, border);
      if (k > 0) fill(row, border + (k - 1) * size, size);
      row.push_back({border + k * size + i, -1.0});
    }
  for (int i = 0; i < border; ++i) {
    auto& row = rows.emplace_back();
    fill(row, 0, border);
    fill(row, border + (segments - 1) * size, size);
  }
  return rows;
}

}  // namespace
}  // namespace costate

int main() {
  using namespace costate;
  fmt::print("{:>6} {:>9} {:>12} {:>12} {:>12}\n", "size", "segments", "factor, us", "solve, us", "condition");
  for (const int size : {2, 4, 6})
    for (int segments = 10; segments <= 640; segments *= 2) {
      const Staircase::Layout layout{size, std::vector<int>(static_cast<std::size_t>(segments), size)};
      const auto rows = chain(size, segments, size);
      const Eigen::VectorXd ones = Eigen::VectorXd::Ones(std::ssize(rows));
      const Staircase staircase(rows, layout, ones, ones);
      const double each = 1e6 / segments;
      fmt::print("{:>6} {:>9} {:>12.3f} {:>12.3f} {:>12.3f}\n", size, segments,
                 each * median_seconds([&] { Staircase(rows, layout, ones, ones); }),
                 each * median_seconds([&] { return staircase.solve(ones); }),
                 each * median_seconds([&] { return staircase.condition(); }));
    }
}
