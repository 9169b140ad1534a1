/// The flags --vary NAME=FROM:TO[:COUNT] and --at.
#include "command_line.hpp"

#include <costate/error.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fmt/format.h>

namespace costate::tools {

namespace {

constexpr int most_values = 10000;

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == separator) {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

int parse_count(const std::string& flag, const std::string& text) {
  int count = 0;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, count);
  if (text.empty() || stop != end || error != std::errc{} || count < 2 || count > most_values) {
    throw BadInput(
        fmt::format("{}: COUNT '{}' is not admissible: admissible 2 … {}, a whole number", flag, text, most_values));
  }
  return count;
}

}  // namespace

void CommandLine::variation_flags() {
  for (const auto& number : numbers_) variable_.push_back(number.get());
  vary_option_ = text("--vary", vary_,
                      "Follow the solution while a number of the scene runs from one value to another; with COUNT, "
                      "evenly spaced values are shown, else the steps taken. --csv then has one line a point, and none "
                      "for events",
                      "NAME=FROM:TO[:COUNT]");
  at_option_ = text("--at", at_, "With --vary: further values to show", "VALUE,...");
}

void CommandLine::read_variation() {
  if (vary_option_ == nullptr) return;
  if (!given(vary_option_)) {
    if (given(at_option_)) throw BadInput("--at needs --vary: it names values on the way");
    return;
  }
  const auto equals = vary_.find('=');
  const std::string name = vary_.substr(0, equals);
  const auto found = std::find_if(variable_.begin(), variable_.end(),
                                  [&](const Number* n) { return n->flag == "--" + name; });
  if (found == variable_.end()) {
    std::string names;
    for (const Number* number : variable_) names += (names.empty() ? "" : ", ") + number->flag.substr(2);
    throw BadInput(
        fmt::format("--vary '{}' names no number of the scene: NAME=FROM:TO[:COUNT] with NAME one of {}", vary_, names));
  }
  const Number& number = **found;
  if (given(number.option)) throw BadInput(fmt::format("--vary {} and {} exclude each other", name, number.flag));
  const std::vector<std::string> parts = split(equals == std::string::npos ? "" : vary_.substr(equals + 1), ':');
  if (parts.size() < 2 || parts.size() > 3) {
    throw BadInput(fmt::format("--vary '{}' is not of the form NAME=FROM:TO[:COUNT]; {} admits {}", vary_, name,
                               number.range.describe()));
  }
  const std::string flag = "--vary " + name;
  Variation variation{.name = name, .unit = number.unit, .values = {}, .store = number.store};
  variation.from = parse_number(flag, parts[0], number.range);
  variation.to = parse_number(flag, parts[1], number.range);
  if (variation.from == variation.to) {
    throw BadInput(fmt::format("--vary {}: FROM and TO are both {}: they must differ; admissible {}", name, parts[0],
                               number.range.describe()));
  }
  std::vector<double>& values = variation.values;
  if (parts.size() == 3) {
    const int count = parse_count(flag, parts[2]);
    variation.count = count;
    for (int i = 0; i < count; ++i) {
      values.push_back(i + 1 == count ? variation.to
                                      : std::lerp(variation.from, variation.to, static_cast<double>(i) / (count - 1)));
    }
  }
  if (given(at_option_)) {
    const double low = std::min(variation.from, variation.to), high = std::max(variation.from, variation.to);
    for (const std::string& text : split(at_, ',')) values.push_back(parse_number("--at", text, {low, high, number.unit}));
    values.push_back(variation.from);
    values.push_back(variation.to);
  }
  if (number.range.nonzero && std::find(values.begin(), values.end(), 0.0) != values.end()) {
    throw BadInput(fmt::format("{}: 0 is among the values to show and not admissible: admissible {}", flag,
                               number.range.describe()));
  }
  const bool down = variation.to < variation.from;
  std::sort(values.begin(), values.end(), [&](double a, double b) { return down ? a > b : a < b; });
  values.erase(std::unique(values.begin(), values.end()), values.end());
  variation.store(variation.from);
  variation_ = std::move(variation);
}

}  // namespace costate::tools
