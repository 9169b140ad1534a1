#include "command_line.hpp"

#include "output.hpp"

#include <costate/error.hpp>
#include <costate/shooting/solve.hpp>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <iostream>
#include <system_error>

namespace costate::tools {

bool Range::admits(double value) const { return value >= lower && value <= upper && !(nonzero && value == 0.0); }

std::string Range::describe() const {
  return fmt::format("{:g} … {:g}{}{}{}", lower, upper, unit.empty() ? "" : " ", unit, nonzero ? ", not 0" : "");
}

double parse_number(const std::string& flag, const std::string& text, const Range& range) {
  const char* begin = text.data();
  const char* end = begin + text.size();
  if (end - begin > 1 && begin[0] == '+' && begin[1] != '-') ++begin;
  double value = 0.0;
  const auto [stop, error] = std::from_chars(begin, end, value);
  if (begin == end || stop != end || (error != std::errc{} && error != std::errc::result_out_of_range)) {
    throw BadInput(fmt::format("{} '{}' is not a number: admissible {}", flag, text, range.describe()));
  }
  if (error == std::errc::result_out_of_range || !range.admits(value)) {
    throw BadInput(fmt::format("{} {} is not admissible: admissible {}", flag, text, range.describe()));
  }
  return value;
}

CommandLine::CommandLine(const std::string& tool, const std::string& description)
    : app_(std::make_unique<CLI::App>(description, tool)), tool_(tool) {
  app_->set_version_flag("--version", fmt::format("{} {}", tool, COSTATE_VERSION), "Print the version and exit");
  app_->set_help_flag("--help", "Print this help and exit");
  app_->get_formatter()->column_width(34);
  app_->allow_windows_style_options(false);
}

CommandLine::~CommandLine() = default;

void CommandLine::footer(const std::string& text) { app_->footer(text); }

CLI::Option* CommandLine::text(const std::string& flag, std::string& target, const std::string& help,
                               const std::string& type) {
  return app_->add_option(flag, target, help)->type_name(type);
}

bool CommandLine::given(const CLI::Option* option) { return option->count() > 0; }

CommandLine::Number& CommandLine::add(const std::string& flag, const Range& range, const std::string& help) {
  numbers_.push_back(std::make_unique<Number>(Number{.flag = flag, .text = "", .range = range, .unit = range.unit}));
  Number& number = *numbers_.back();
  number.option = text(flag, number.text, help, range.unit.empty() ? "NUMBER" : range.unit);
  return number;
}

void CommandLine::number(const std::string& flag, double& target, const Range& range, const std::string& help) {
  add(flag, range, fmt::format("{} [{:.12g}]; {}", help, target, range.describe())).store = [&target](double v) { target = v; };
}

void CommandLine::number(const std::string& flag, std::optional<double>& target, const Range& range,
                         const std::string& help) {
  add(flag, range, fmt::format("{}; {}", help, range.describe())).store = [&target](double v) { target = v; };
}

void CommandLine::choice(const std::string& flag, std::string& target, const std::vector<std::string>& words,
                         const std::string& help) {
  text(flag, target, fmt::format("{} [{}]; {}", help, target, fmt::join(words, ", ")), "NAME");
  choices_.push_back({flag, &target, words});
}

void CommandLine::number_or(const std::string& flag, std::optional<double>& target, Range range, const std::string& word,
                            const std::string& help) {
  const std::string unit = range.unit;
  range.unit = fmt::format("{} or {}", unit, word);
  const std::string given = target ? fmt::format("{:.12g}", *target) : word;
  Number& number = add(flag, range, fmt::format("{} [{}]; {}", help, given, range.describe()));
  number.unit = unit;
  number.store = [&target](double v) { target = v; };
  number.word = word;
  number.store_word = [&target] { target.reset(); };
}

void CommandLine::toggle(const std::string& flag, bool& target, const std::string& help) { app_->add_flag(flag, target, help); }

void CommandLine::solver_flags() {
  number("--accuracy", accuracy, {finest_accuracy, coarsest_accuracy, ""},
         "Wanted absolute error (relative above 1) of times and unknowns");
  choice("--engine", engine_, {engine_name(Method::adams), engine_name(Method::runge_kutta)},
         "What integrates: Adams' method of CVODES, or Verner's Runge-Kutta pair 8(7), which is faster");
  auto* json_flag = app_->add_flag("--json", json, "Print one JSON object");
  csv_option_ = text("--csv", csv, "Write the trajectory to a file, - for standard output", "FILE")->excludes(json_flag);
  app_->add_flag("--quiet", quiet, "Print no table; the exit status tells");
}

const char* engine_name(Method method) { return method == Method::runge_kutta ? "rk87" : "cvodes"; }

Method CommandLine::method() const {
  return engine_ == engine_name(Method::runge_kutta) ? Method::runge_kutta : Method::adams;
}

void CommandLine::store_numbers() {
  for (const auto& number : numbers_) {
    if (!given(number->option)) continue;
    if (!number->word.empty() && number->text == number->word) {
      number->store_word();
    } else {
      number->store(parse_number(number->flag, number->text, number->range));
    }
  }
}

void CommandLine::check_choices() const {
  for (const Choice& choice : choices_) {
    if (std::find(choice.words.begin(), choice.words.end(), *choice.target) != choice.words.end()) continue;
    throw BadInput(fmt::format("{} '{}' is not admissible: admissible {}", choice.flag, *choice.target,
                               fmt::join(choice.words, ", ")));
  }
}

std::string CommandLine::explain(const CLI::ParseError& error) const {
  std::string text = error.what();
  for (const auto& number : numbers_) {
    if (text.find(number->flag + ":") != std::string::npos || text.find(number->flag + " ") == 0) {
      text += fmt::format(" (admissible {})", number->range.describe());
    }
  }
  for (const Choice& choice : choices_) {
    if (text.find(choice.flag + ":") != std::string::npos || text.find(choice.flag + " ") == 0) {
      text += fmt::format(" (admissible {})", fmt::join(choice.words, ", "));
    }
  }
  return text;
}

std::optional<int> CommandLine::parse(int argc, char** argv) {
  try {
    app_->parse(argc, argv);
    store_numbers();
    check_choices();
    read_variation();
    if (!csv.empty()) check_writable("--csv", csv);
    if (csv.empty() && csv_option_ != nullptr && given(csv_option_)) throw BadInput("--csv '' is not a file name");
    return std::nullopt;
  } catch (const CLI::Success& done) {
    const int status = app_->exit(done);
    std::cout.flush();
    if (std::cout) return status;
    fmt::print(stderr, "{}: the output could not be written\n", tool_);
    return exit_failed;
  } catch (const CLI::ParseError& error) {
    fmt::print(stderr, "{}: {}; see --help\n", tool_, explain(error));
  } catch (const BadInput& error) {
    fmt::print(stderr, "{}: {}\n", tool_, error.what());
  }
  return exit_bad_input;
}

int run(const std::string& tool, const std::function<int()>& body) {
  try {
    const int status = body();
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
      fmt::print(stderr, "{}: the output could not be written\n", tool);
      return exit_failed;
    }
    return status;
  } catch (const BadInput& error) {
    fmt::print(stderr, "{}: {}\n", tool, error.what());
    return exit_bad_input;
  } catch (const std::system_error& error) {
    fmt::print(stderr, "{}: the output could not be written: {}\n", tool, error.what());
    return exit_failed;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}: unexpected failure: {}; please report it with the command line\n", tool, error.what());
    return exit_failed;
  }
}

}  // namespace costate::tools
