/// \file
/// A paper's printed numbers, and what to say of each beside the computed one.
#pragma once

#include "cases.hpp"

#include <optional>
#include <string>
#include <vector>

namespace costate::reproduce {

/// Cases are solved to 1e-11, so that many digits of what is computed are shown.
inline constexpr int shown_digits = 12;

/// One printed number. Data; see the JSON files beside this one.
struct Printed {
  std::string place;     ///< where in the paper
  std::string quantity;  ///< name among the quantities of its case
  std::string unit;
  std::string value;     ///< as printed, or as known of it; a dash where the paper says that the bead does not arrive
  Case source;           ///< what computes it
  std::optional<Case> optimum;  ///< what the number claims to be the minimum of: computed beside it
  std::string misprint;  ///< why the printed number is known to be wrong; empty if it is not
};

struct Paper {
  std::string key;    ///< "[K]"
  std::string paper;  ///< authors, journal, year
  std::string title;
  std::string note;   ///< where the column of printed numbers comes from
  std::vector<Printed> rows;
};

/// \throws nlohmann::json::exception if the text is not of the form of the files beside this one.
[[nodiscard]] Paper parse(const std::string& json);

/// A printed number beside the computed one.
struct Comparison {
  const Paper* paper = nullptr;
  const Printed* printed = nullptr;
  std::optional<double> computed{};  ///< none: the bead does not arrive
  double error_bound = 0.0;
  std::optional<int> digits{};  ///< that agree; none where one of the two is no number
  std::string verdict{};  ///< agrees; misprint: …; not optimal: true minimum …; or differs
  bool expected = false;  ///< agrees, or differs as the committed list of misprints says
};

[[nodiscard]] Comparison compare(const Paper& paper, const Printed& printed, Cases& cases);

}  // namespace costate::reproduce
