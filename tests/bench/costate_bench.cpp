/// CPU time of whole solves from a rough guess to a true error, by the library and by hand, and their ratios in one run. Flags are those of
/// Google Benchmark; the table at the end is our own.
#include "contender.hpp"

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <cstdlib>
#include <iostream>
#include <map>

namespace {

using costate::bench::Contender;
using costate::bench::Path;
using costate::bench::path_points;
using costate::bench::Tuned;

constexpr double targets[] = {1e-6, 1e-9, 1e-12};

/// Keeps the medians, and prints the machine.
class Medians final : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context& context) override {
    PrintBasicContext(&std::cout, context);
    return true;
  }
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (run.aggregate_name == "median") microseconds[run.run_name.function_name] = run.GetAdjustedCPUTime();
    }
  }
  std::map<std::string, double> microseconds;
};

struct Entry {
  double target;
  Tuned tuned;
  [[nodiscard]] std::string name() const {
    return fmt::format("{}/{}/{:.0e}", tuned.contender->problem, tuned.contender->solver, target);
  }
};

/// False if a yardstick has missed its error.
bool print(const std::vector<Entry>& entries, const std::map<std::string, double>& microseconds) {
  fmt::print("\n{:3} {:6} {:36} {:>8} {:>9} {:>6} {:>6} {:>4} {:>8} {:>8}\n", "", "error", "solver", "ratio", "us", "rhs",
             "steps", "its", "setting", "true");
  double yardstick = 0.0;
  for (const Entry& entry : entries) {
    const Contender& contender = *entry.tuned.contender;
    const bool is_yardstick = contender.solver == "yardstick";
    const auto found = microseconds.find(entry.name());
    if (entry.tuned.solve == nullptr) {
      fmt::print("{:3} {:6.0e} {:36} not reached\n", contender.problem, entry.target, contender.solver);
      if (is_yardstick) return false;
    }
    if (found == microseconds.end()) continue;
    const auto& o = entry.tuned.outcome;
    const double error = contender.error(o);
    if (is_yardstick) yardstick = found->second;
    fmt::print("{:3} {:6.0e} {:36} {:>8} {:9.2f} {:6} {:6} {:4} {:8.1e} {:8.1e}\n", contender.problem, entry.target,
               contender.solver, yardstick > 0.0 ? fmt::format("{:.2f}", found->second / yardstick) : "-", found->second,
               o.evaluations, o.steps, o.iterations, entry.tuned.setting, error);
  }
  return true;
}

/// Microseconds a point. False if a path has not all of its roots.
bool print(const std::vector<Path>& paths, const std::map<std::string, double>& microseconds) {
  fmt::print("\n{:46} {:>8} {:>9} {:>9}\n", "a point of a path of 40, to 1e-9", "ratio", "us", "cold us");
  bool complete = true;
  for (const Path& path : paths) {
    const auto along = microseconds.find(path.name + "/along"), cold = microseconds.find(path.name + "/cold");
    if (along == microseconds.end() || cold == microseconds.end()) continue;
    const bool found = path.along() && path.cold();
    complete = complete && found;
    fmt::print("{:46} {:8.2f} {:9.2f} {:9.2f}{}\n", path.name, along->second / cold->second, along->second / path_points,
               cold->second / path_points, found ? "" : "  NOT ALL FOUND");
  }
  return complete;
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<char*> arguments(argv, argv + argc);
  std::string defaults[] = {"--benchmark_enable_random_interleaving=true", "--benchmark_repetitions=9",
                            "--benchmark_min_time=0.01", "--benchmark_report_aggregates_only=true"};
  int place = 1;
  for (std::string& flag : defaults) arguments.insert(arguments.begin() + place++, flag.data());
  int count = static_cast<int>(arguments.size());
  benchmark::Initialize(&count, arguments.data());
  if (benchmark::ReportUnrecognizedArguments(count, arguments.data())) return EXIT_FAILURE;

  const auto all = costate::bench::contenders();
  std::vector<Entry> entries;
  for (std::size_t begin = 0, end = 0; begin < all.size(); begin = end) {
    while (end < all.size() && all[end].problem == all[begin].problem) ++end;
    for (const double target : targets) {
      for (std::size_t i = begin; i < end; ++i) entries.push_back({target, tune(all[i], target)});
    }
  }
  for (const Entry& entry : entries) {
    if (entry.tuned.solve == nullptr) continue;
    benchmark::RegisterBenchmark(entry.name().c_str(), [&tuned = entry.tuned](benchmark::State& state) {
      for (auto _ : state) benchmark::DoNotOptimize((*tuned.solve)(tuned.setting));
    })->Unit(benchmark::kMicrosecond);
  }
  const auto paths = costate::bench::paths();
  for (const Path& path : paths) {
    for (const auto& [name, run] : {std::pair{"/along", &path.along}, std::pair{"/cold", &path.cold}}) {
      benchmark::RegisterBenchmark((path.name + name).c_str(), [run = run](benchmark::State& state) {
        for (auto _ : state) benchmark::DoNotOptimize((*run)());
      })->Unit(benchmark::kMicrosecond);
    }
  }
  Medians reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  benchmark::Shutdown();
  const bool exact = print(entries, reporter.microseconds), complete = print(paths, reporter.microseconds);
  return exact && complete ? EXIT_SUCCESS : EXIT_FAILURE;
}
