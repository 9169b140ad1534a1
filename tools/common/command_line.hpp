/// \file
/// The command line every tool shares: scene flags with ranges and units, accuracy, output.
#pragma once

#include <costate/flow.hpp>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

// CLI11 stays in the sources: it costs every file that sees it seconds of compilation.
namespace CLI {
class App;
class Option;
class ParseError;
}  // namespace CLI

namespace costate::tools {

/// Exit statuses of every tool.
enum ExitStatus { exit_solved = 0, exit_bad_input = 2, exit_infeasible = 3, exit_failed = 4 };

/// Admissible values of a number. A zero that lies inside is admissible unless `nonzero`.
struct Range {
  double lower;
  double upper;
  std::string unit;
  bool nonzero = false;
  [[nodiscard]] bool admits(double value) const;
  [[nodiscard]] std::string describe() const;
};

/// Text to a finite number within the range. \throws BadInput naming flag, text and range.
[[nodiscard]] double parse_number(const std::string& flag, const std::string& text, const Range& range);

/// A number of the scene that is to run from one value to another.
struct Variation {
  std::string name;  ///< of the flag, without dashes
  std::string unit;
  double from = 0.0, to = 0.0;
  std::optional<int> count{};          ///< of evenly spaced values, if that was asked for
  std::vector<double> values;          ///< asked for, in order from `from` to `to`; none: the branch's own steps are shown
  std::function<void(double)> store;   ///< sets the number in the scene
};

/// The word of --engine for a method.
[[nodiscard]] const char* engine_name(Method method);

/// A tool's command line. Numbers are read as text and checked after all flags are known, so that every message is ours.
class CommandLine {
 public:
  CommandLine(const std::string& tool, const std::string& description);
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;
  ~CommandLine();

  /// A number with a default, which `help` need not repeat.
  void number(const std::string& flag, double& target, const Range& range, const std::string& help);
  /// A number that may be left out.
  void number(const std::string& flag, std::optional<double>& target, const Range& range, const std::string& help);
  /// One of several words.
  void choice(const std::string& flag, std::string& target, const std::vector<std::string>& words, const std::string& help);
  /// A number with a default, or a word instead of it: then the target is emptied.
  void number_or(const std::string& flag, std::optional<double>& target, Range range, const std::string& word,
                 const std::string& help);
  /// A switch.
  void toggle(const std::string& flag, bool& target, const std::string& help);
  /// Text after the list of flags in --help.
  void footer(const std::string& text);

  /// Adds --accuracy, --engine, --json, --csv and --quiet.
  void solver_flags();
  /// Adds --vary and --at, for the numbers given so far.
  void variation_flags();
  /// What --vary asks for, if it was given. The scene's number has the value at which the variation starts.
  [[nodiscard]] const std::optional<Variation>& variation() const { return variation_; }

  /// Reads the arguments. Returns the exit status if the tool is done (help, version, bad input), nothing if it should go on.
  [[nodiscard]] std::optional<int> parse(int argc, char** argv);

  /// What --engine stands for.
  [[nodiscard]] Method method() const;

  double accuracy = 1e-8;
  bool json = false;
  bool quiet = false;
  std::string csv;

 private:
  struct Number {
    std::string flag;
    std::string text;
    CLI::Option* option = nullptr;
    Range range;
    std::string unit{};  ///< of the number itself
    std::function<void(double)> store{};
    std::string word{};  ///< admitted in place of a number, if any
    std::function<void()> store_word{};
  };
  struct Choice {
    std::string flag;
    std::string* target;
    std::vector<std::string> words;
  };
  /// An option whose text is kept as it is given. `type` is how --help names its value.
  CLI::Option* text(const std::string& flag, std::string& target, const std::string& help, const std::string& type);
  [[nodiscard]] static bool given(const CLI::Option* option);
  Number& add(const std::string& flag, const Range& range, const std::string& help);
  void store_numbers();
  void read_variation();
  void check_choices() const;
  [[nodiscard]] std::string explain(const CLI::ParseError& error) const;

  std::unique_ptr<CLI::App> app_;
  std::string engine_ = engine_name(Method::adams);
  CLI::Option* csv_option_ = nullptr;
  std::string vary_, at_;
  CLI::Option *vary_option_ = nullptr, *at_option_ = nullptr;
  std::vector<const Number*> variable_;  ///< the numbers that may be varied
  std::optional<Variation> variation_;
  std::string tool_;
  std::vector<std::unique_ptr<Number>> numbers_;
  std::vector<Choice> choices_;
};

/// Runs a tool's body: bad input found late is status 2, anything unforeseen status 4, each with a message on stderr.
int run(const std::string& tool, const std::function<int()>& body);

}  // namespace costate::tools
