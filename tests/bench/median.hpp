/// \file
/// How long a piece of work takes.
#pragma once

#include <costate/shooting/solve.hpp>

#include <algorithm>
#include <vector>

namespace costate::bench {

/// Median CPU time of the thread, seconds, over repetitions of about `total` seconds in all, at least 5, after one that does not count.
template <class Work>
double median_seconds(const Work& work, double total) {
  std::vector<double> times;
  work();
  for (double spent = 0.0; spent < total || times.size() < 5; spent += times.back()) {
    const double begin = thread_seconds();
    work();
    times.push_back(thread_seconds() - begin);
  }
  const auto middle = times.begin() + std::ssize(times) / 2;
  std::nth_element(times.begin(), middle, times.end());
  return *middle;
}

}  // namespace costate::bench
