/// The numbers of the papers beside the computed ones.
#include "common/command_line.hpp"
#include "disk/disk_scene.hpp"
#include "papers.hpp"

#include <costate/error.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <map>
#include <nlohmann/json.hpp>

using namespace costate;

namespace {

constexpr const char* description =
    "Solves the cases of the papers the models come from and prints their numbers beside the computed ones.\n"
    "Exit status: 0 every row agrees, 4 one does not, 2 bad input.";

struct PaperRow {
  std::string place, quantity, unit, paper;
  double computed = 0.0, error_bound = 0.0;

  /// Half a unit in the last digit the paper gives, and what the computation may be off by.
  [[nodiscard]] bool agrees() const {
    const auto point = paper.find('.');
    const double last_digit = std::pow(10.0, -static_cast<double>(paper.size() - point - 1));
    return std::abs(computed - std::stod(paper)) <= 0.5 * last_digit + error_bound;
  }
  [[nodiscard]] int digits() const {
    const double difference = std::abs(computed / std::stod(paper) - 1.0);
    return std::min(16, static_cast<int>(-std::log10(std::max(difference, 1e-17))));
  }
};

/// A quantity of a solved disk scene. The friction range has the error of the costates it is made of.
void fill(PaperRow& row, const disk::Outcome& outcome) {
  const double range_bound = outcome.solution["lambda_x"].error_bound;
  if (row.quantity == "F_max" || row.quantity == "F_min") {
    row.computed = row.quantity == "F_max" ? outcome.F_max.value() : outcome.F_min.value();
    row.error_bound = range_bound;
  } else {
    row.computed = outcome.solution[row.quantity].value;
    row.error_bound = outcome.solution[row.quantity].error_bound;
  }
}

std::vector<PaperRow> disk_rows(const nlohmann::json& paper, double accuracy) {
  std::map<std::string, disk::Outcome> cases;
  std::vector<PaperRow> rows;
  for (const auto& entry : paper.at("rows")) {
    PaperRow row{entry.at("place"), entry.at("quantity"), entry.at("unit"), entry.at("value")};
    if (!cases.contains(row.place)) {
      disk::Scene scene;
      if (entry.contains("friction")) scene.friction = entry.at("friction").get<double>();
      cases[row.place] = disk::solve_scene(scene, {.accuracy = accuracy});
    }
    const disk::Outcome& outcome = cases.at(row.place);
    if (outcome.status != disk::Outcome::Status::solved) throw std::runtime_error(row.place + ": " + outcome.message);
    fill(row, outcome);
    rows.push_back(std::move(row));
  }
  return rows;
}

void print_table(const nlohmann::json& paper, const std::vector<PaperRow>& rows, bool markdown) {
  if (!markdown) fmt::print("{}\n{}\n({})\n\n", paper.at("title").get<std::string>(), paper.at("paper").get<std::string>(),
                            paper.at("note").get<std::string>());
  const char* line = markdown ? "| {} | {} | {} | {} | {} | {} | {} |\n" : "{:<18}  {:<10}  {:<4}  {:>20}  {:>20}  {:>6}  {}\n";
  fmt::print(fmt::runtime(line), "case", "quantity", "unit", "paper", "computed", "digits", "verdict");
  if (markdown) fmt::print("|---|---|---|---|---|---|---|\n");
  for (const PaperRow& row : rows) {
    fmt::print(fmt::runtime(line), row.place, row.quantity, row.unit, row.paper, fmt::format("{:.16g}", row.computed),
               row.digits(), row.agrees() ? "agrees" : "differs");
  }
}

nlohmann::ordered_json to_json(const nlohmann::json& paper, const std::vector<PaperRow>& rows) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const PaperRow& row : rows) {
    list.push_back({{"paper", paper.at("paper")},
                    {"place", row.place},
                    {"quantity", row.quantity},
                    {"unit", row.unit},
                    {"printed", row.paper},
                    {"computed", row.computed},
                    {"error_bound", row.error_bound},
                    {"digits", row.digits()},
                    {"verdict", row.agrees() ? "agrees" : "differs"}});
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
    const auto paper = nlohmann::json::parse(tools::rolling_disk_paper);
    const std::vector<PaperRow> rows = disk_rows(paper, 1e-11);
    if (json) {
      fmt::print("{}\n", to_json(paper, rows).dump(2));
    } else {
      print_table(paper, rows, markdown);
    }
    const bool all = std::all_of(rows.begin(), rows.end(), [](const PaperRow& row) { return row.agrees(); });
    return all ? tools::exit_solved : tools::exit_failed;
  });
}
