/// \file
/// One evaluation of a shooting function: unknowns and parameters in, arcs integrated, rows and reports out.
#pragma once

#include <costate/flow.hpp>
#include <costate/jet.hpp>

#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace costate {

/// What an arc starts from. State, quadratures and constants are jets: only the columns that really move them cost
/// sensitivities. The variable of integration runs from t0 to t1, backward if t1 < t0. It is the time, unless the field is stated
/// in another one (an angle that runs monotonically); then one of the quadratures is the time.
struct ArcStart {
  int arc = 0;  ///< place of the arc in the problem's sequence
  const Field* field = nullptr;
  Jet t0{}, t1{};
  double clock = 0.0;  ///< time of the chain of arcs at the integration variable's 0, in the integration's unit
  Jets state{};        ///< z₀ (n)
  Jets quadrature{};   ///< w₀ (k)
  Jets parameter{};    ///< p (m)
  std::optional<int>
      time_quadrature{};  ///< place in w of the time of the chain; none: the variable of integration is the time
};

struct ArcEnd {
  Jets state;
  Jets quadrature;
};

/// A call of Shot::arc and a segment of that arc, counted from 0.
struct SegmentPlace {
  std::size_t call = 0;
  std::size_t segment = 0;
};

/// The numbers of an integrated arc, or of one of its segments, enough to integrate it again.
struct ArcRecord {
  int arc = 0;
  SegmentPlace place{};
  const Field* field = nullptr;
  double t0 = 0.0, t1 = 0.0, clock = 0.0;
  std::optional<int> time_quadrature{};          ///< see ArcStart
  double time_unit = 1.0;                        ///< of the integration, in the unit of the problem's reports
  Eigen::VectorXd state, quadrature, parameter;  ///< z, w at t0; p
  Eigen::VectorXd end_state;                     ///< z at t1
  std::vector<double> constants;                 ///< the problem's constants of motion, as given to Shot::complete
};

/// A quantity a problem reports besides its unknowns: final time, switching times, …
struct Report {
  std::string name;
  std::string unit;
  Jet value;
};

/// What can happen to a solution as a parameter moves.
enum class EventKind {
  fold,       ///< the branch turns back in the parameter
  arc_birth,  ///< a constraint is touched, or a multiplier or switching function changes its sign: an arc is needed there
  arc_death,  ///< the duration of an arc reaches zero
  limit,      ///< there is no solution beyond
};
[[nodiscard]] const char* describe(EventKind kind);

/// A quantity that is positive as long as the arc structure is right. Along a branch its zero is an event of the given kind. The
/// value is a jet, so that the place of the zero can be solved for.
struct Guard {
  EventKind kind = EventKind::arc_birth;
  std::string name;  ///< what vanishes: "duration of arc 2", "friction left at the end"
  Jet value;
};

/// Where arcs are cut for multiple shooting: for each call of Shot::arc, in their order, its nodes as fractions of the way from t0 to t1,
/// ascending within (0, 1). A call beyond the end of the list is not cut.
using Cuts = std::vector<std::vector<double>>;

/// Integrators by field; shared by all shots of one problem so that memory is allocated once.
class FlowCache {
 public:
  void set_options(const FlowOptions& options);
  [[nodiscard]] const FlowOptions& options() const { return options_; }
  Flow& operator[](const Field& field);
  [[nodiscard]] Statistics statistics() const;

 private:
  FlowOptions options_;
  std::map<const Field*, Flow> flows_;
};

/// Handed to a problem's shooting function.
///
/// Where an arc is cut, each of its segments starts from a node of its own, whose state and quadratures are unknowns too, and `matches`
/// has one equation for each: what the segment before arrives with, minus the node. The shooting function sees the end of the last
/// segment and need not know.
///
/// A shot can be used over and over, and allocates nothing after the first time as long as the arcs and their sizes stay the same.
class Shot {
 public:
  Shot(FlowCache& flows, std::vector<Jet> unknowns, std::vector<Jet> parameters, std::size_t rows)
      : flows_(&flows), unknowns_(std::move(unknowns)), parameters_(std::move(parameters)), rows_(rows) {}

  /// Cuts the arcs; `nodes` are the values (z, w) of all nodes, one after the other, in the order of the cuts.
  void cut(const Cuts& cuts, std::vector<Jet> nodes) {
    cuts_ = &cuts;
    nodes_ = std::move(nodes);
  }
  /// Integrates nothing: an arc with a guess of its end state, n values, ends there, any other where it starts. What arcs there are is
  /// then in arcs().
  using EndGuess = std::function<std::optional<Eigen::VectorXd>(int arc)>;
  void sketch(EndGuess guess) { sketch_ = std::move(guess); }

  /// Another evaluation: unknowns and nodes, one after the other, have the values y and the derivatives they had; what was found before
  /// is forgotten. Reports and guards are kept of an evaluation that wants them alone.
  void restart(std::span<const double> y, bool wants_reports);
  void set_parameter(std::size_t i, const Jet& value) { parameters_.at(i) = value; }
  /// The same evaluation once more, this time with reports and guards: no arc is integrated again.
  void replay();
  /// Called when the shooting function has returned.
  void finish();

  [[nodiscard]] const Jet& unknown(std::size_t i) const { return unknowns_.at(i); }
  [[nodiscard]] const Jet& parameter(std::size_t i) const { return parameters_.at(i); }

  /// Integrates one arc. \throws LeftDomain naming the arc, BadInput where what it starts from does not fit its field.
  ArcEnd arc(const ArcStart& start);
  void row(std::size_t i, const Jet& value) { rows_.at(i) = value; }
  /// Are report() and guard() of any use in this evaluation? Else what they are given need not be made.
  [[nodiscard]] bool wants_reports() const { return wants_reports_; }
  void report(std::string_view name, std::string_view unit, const Jet& value) {
    if (wants_reports_) reports_.push_back({std::string(name), std::string(unit), value});
  }
  /// Guards keep their number and order as long as the structure is the same.
  void guard(EventKind kind, std::string_view name, const Jet& value) {
    if (wants_reports_) guards_.push_back({kind, std::string(name), value});
  }

  /// Called last, for those who observe the arcs. Where these were integrated outward from an inner point, `origin` is added to
  /// every recorded quadrature; the problem's constants of motion are kept with every arc; and `time_unit` says how long the unit
  /// of the integration is in that of the reports, where a problem computes in units of its own.
  void complete(std::span<const double> origin, std::span<const double> constants, double time_unit = 1.0);
  void complete(std::initializer_list<double> origin, std::initializer_list<double> constants, double time_unit = 1.0) {
    complete(std::span(origin.begin(), origin.size()), std::span(constants.begin(), constants.size()), time_unit);
  }

  [[nodiscard]] const std::vector<Jet>& rows() const { return rows_; }
  [[nodiscard]] const std::vector<Jet>& matches() const { return matches_; }
  /// The segment integrated last, or in which an integration failed.
  [[nodiscard]] SegmentPlace place() const { return place_; }
  [[nodiscard]] const std::vector<Report>& reports() const { return reports_; }
  [[nodiscard]] const std::vector<Guard>& guards() const { return guards_; }
  [[nodiscard]] const std::vector<ArcRecord>& arcs() const { return arcs_; }

 private:
  /// Numbers that integrations start from, each followed by its derivatives.
  struct Scratch {
    std::vector<int> columns;
    std::vector<double> state, parameter;
  };

  ArcEnd integrate(const ArcStart& start);
  [[nodiscard]] ArcStart moved(const ArcStart& start) const;
  ArcEnd sketched(const ArcStart& start);
  /// The values of the next node, `count` of them.
  Jets node(std::size_t count);
  ArcRecord& record(const ArcStart& start);
  void begin();
  void rates(double t, const ArcStart& start, const double* state, std::size_t stride, double* result) const;

  FlowCache* flows_;
  const Cuts* cuts_ = nullptr;
  EndGuess sketch_;
  std::vector<Jet> nodes_, matches_;
  std::size_t next_node_ = 0;  ///< place in nodes_
  std::size_t calls_ = 0, recorded_ = 0;
  bool wants_reports_ = true, replays_ = false;
  SegmentPlace place_;
  std::vector<Jet> unknowns_, parameters_, rows_;
  std::vector<Report> reports_;
  std::vector<Guard> guards_;
  std::vector<ArcRecord> arcs_;
  std::vector<double> reached_;  ///< numbers that integrations end with, one integration after the other
  std::size_t next_reached_ = 0;
  Scratch scratch_;
};

}  // namespace costate
