#include "paper.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace costate::reproduce {

namespace {

constexpr const char* dash = "-";

Case parse_case(const nlohmann::json& entry) {
  Case wanted{entry.at("model"), {}, entry.value("curve", "")};
  for (const auto& [name, value] : entry.at("scene").items()) wanted.scene[name] = value.get<double>();
  return wanted;
}

/// Half a unit in the last printed digit.
double half_last_digit(const std::string& printed) {
  const auto point = printed.find('.');
  return point == std::string::npos ? 0.5 : 0.5 * std::pow(10.0, -static_cast<double>(printed.size() - point - 1));
}

/// Digits that agree, as far as the computed number is shown.
int agreeing_digits(double computed, double printed) {
  const double difference = std::abs(computed / printed - 1.0);
  return std::clamp(static_cast<int>(-std::log10(std::max(difference, 1e-17))), 0, shown_digits);
}

}  // namespace

Paper parse(const std::string& text) {
  const auto json = nlohmann::json::parse(text);
  Paper paper{json.at("key"), json.at("paper"), json.at("title"), json.at("note"), {}};
  for (const auto& group : json.at("groups")) {
    const Case source = parse_case(group);
    std::optional<Case> optimum;
    if (group.contains("optimum")) optimum = parse_case(group.at("optimum"));
    for (const auto& row : group.at("rows")) {
      paper.rows.push_back({group.at("place"), row.at("quantity"), row.value("unit", "1"), row.at("printed"), source, optimum,
                            row.value("misprint", "")});
    }
  }
  return paper;
}

Comparison compare(const Paper& paper, const Printed& printed, Cases& cases) {
  Comparison row{.paper = &paper, .printed = &printed};
  const Computed& computed = cases(printed.source);
  if (const auto found = computed.find(printed.quantity); found != computed.end()) {
    row.computed = found->second.value;
    row.error_bound = found->second.error_bound;
  }
  if (printed.value == dash || !row.computed) {
    const bool agrees = printed.value == dash && !row.computed;
    row.verdict = agrees ? "agrees: the bead stops on the way" : "differs";
    row.expected = agrees;
    return row;
  }
  const double value = std::stod(printed.value);
  row.digits = agreeing_digits(*row.computed, value);
  const bool agrees = std::abs(*row.computed - value) <= half_last_digit(printed.value) + row.error_bound;
  row.expected = agrees == printed.misprint.empty();
  if (!row.expected) {
    row.verdict = agrees ? "agrees, though listed as a misprint" : "differs";
  } else if (!agrees) {
    row.verdict = "misprint: " + printed.misprint;
  } else if (printed.optimum) {
    const Quantity& least = cases(*printed.optimum).at(printed.quantity);
    const bool beaten = least.value + least.error_bound < *row.computed - row.error_bound;
    row.verdict = beaten ? fmt::format("not optimal: true minimum {:.8g}", least.value) : "agrees";
  } else {
    row.verdict = "agrees";
  }
  return row;
}

}  // namespace costate::reproduce
