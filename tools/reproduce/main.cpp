/// The numbers of the papers beside the computed ones.
#include "common/command_line.hpp"
#include "paper.hpp"
#include "papers.hpp"

#include <costate/error.hpp>

#include <algorithm>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

using namespace costate;
using reproduce::Paper;
using reproduce::Comparison;

namespace {

constexpr const char* description =
    "Solves the cases of the papers the models come from and prints their numbers beside the computed ones.\n"
    "Exit status: 0 every row agrees or is a known misprint, 4 one is neither, 2 bad input.";

std::string computed_text(const Comparison& row) { return row.computed ? fmt::format("{:.{}g}", *row.computed, reproduce::shown_digits) : "-"; }
std::string digits_text(const Comparison& row) { return row.digits ? fmt::format("{}", *row.digits) : ""; }

void print_table(const std::vector<Paper>& papers, const std::vector<Comparison>& rows, bool markdown) {
  const char* line = markdown ? "| {} | {} | {} | {} | {} | {} | {} | {} |\n"
                              : "{:<4} {:<34}  {:<13}  {:<6}  {:>20}  {:>20}  {:>6}  {}\n";
  fmt::print(fmt::runtime(line), "", "place", "quantity", "unit", "printed", "computed", "digits", "verdict");
  if (markdown) fmt::print("|---|---|---|---|---|---|---|---|\n");
  for (const Comparison& row : rows) {
    fmt::print(fmt::runtime(line), row.paper->key, row.printed->place, row.printed->quantity, row.printed->unit,
               row.printed->value, computed_text(row), digits_text(row), row.verdict);
  }
  if (markdown) return;
  fmt::print("\n");
  for (const Paper& paper : papers) fmt::print("{} {}: {}\n    ({})\n", paper.key, paper.paper, paper.title, paper.note);
}

nlohmann::ordered_json to_json(const std::vector<Comparison>& rows) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Comparison& row : rows) {
    nlohmann::ordered_json entry{{"paper", row.paper->paper},
                                 {"place", row.printed->place},
                                 {"quantity", row.printed->quantity},
                                 {"unit", row.printed->unit},
                                 {"printed", row.printed->value},
                                 {"computed", nullptr},
                                 {"error_bound", row.error_bound},
                                 {"digits", nullptr},
                                 {"verdict", row.verdict},
                                 {"expected", row.expected}};
    if (row.computed) entry["computed"] = *row.computed;
    if (row.digits) entry["digits"] = *row.digits;
    list.push_back(std::move(entry));
  }
  return {{"schema", "costate/1"}, {"rows", std::move(list)}};
}

}  // namespace

int main(int argc, char** argv) {
  tools::CommandLine line("costate-reproduce", description);
  bool markdown = false, json = false;
  line.toggle("--json", json, "Print one JSON object");
  line.toggle("--markdown", markdown, "Print a Markdown table");
  if (const auto status = line.parse(argc, argv)) return *status;
  return tools::run("costate-reproduce", [&] {
    if (json && markdown) throw BadInput("--json and --markdown exclude each other");
    std::vector<Paper> papers;
    for (const char* text : reproduce::papers) papers.push_back(reproduce::parse(text));
    reproduce::Cases cases(1e-11);
    std::vector<Comparison> rows;
    for (const Paper& paper : papers) {
      for (const auto& printed : paper.rows) rows.push_back(reproduce::compare(paper, printed, cases));
    }
    if (json) {
      fmt::print("{}\n", to_json(rows).dump(2));
    } else {
      print_table(papers, rows, markdown);
    }
    const auto unexpected = std::count_if(rows.begin(), rows.end(), [](const Comparison& row) { return !row.expected; });
    if (unexpected == 0) return tools::exit_solved;
    fmt::print(stderr, "costate-reproduce: {} of {} rows neither agree nor are known misprints\n", unexpected, rows.size());
    return tools::exit_failed;
  });
}
