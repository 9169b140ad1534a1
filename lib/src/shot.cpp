#include <costate/error.hpp>
#include <costate/shot.hpp>

#include <algorithm>
#include <fmt/format.h>

namespace costate {

namespace {

void values(const Jets& jets, Eigen::VectorXd& v) {
  v.resize(static_cast<Eigen::Index>(jets.size()));
  for (std::size_t i = 0; i < jets.size(); ++i) v[static_cast<Eigen::Index>(i)] = jets[i].value;
}

/// The directions in which an arc must be differentiated, and the way back from them to the columns of the problem.
///
/// Either one direction per column that moves any input, or one per input that moves at all: whichever is fewer.
class Seeding {
 public:
  /// `columns` is room to work in.
  Seeding(const Jets& state, const Jets& parameter, std::vector<int>& columns)
      : state_(state), parameter_(parameter), columns_(columns) {
    columns_.clear();
    std::size_t inputs = 0;
    for (const Jets* jets : {&state, &parameter}) {
      for (const Jet& input : *jets) {
        if (input.gradient().empty()) continue;
        ++inputs;
        for (const auto& entry : input.gradient()) add(entry.column);
      }
    }
    by_column_ = columns_.size() <= inputs;
    count_ = by_column_ ? columns_.size() : inputs;
  }

  [[nodiscard]] std::size_t count() const { return count_; }

  /// Numbers and their derivatives as Flow::advance takes them.
  void lift(std::vector<double>& state, std::vector<double>& parameter) const {
    std::size_t input = 0;
    fill(state_, state, input);
    fill(parameter_, parameter, input);
  }

  /// A number with its derivatives as Flow::advance returns them, and what an end time adds to it.
  [[nodiscard]] Jet jet(const double* number, const Jet& end_time, double rate) const {
    Jet sum(number[0]);
    if (by_column_) {
      Jet::Gradient gradient;
      Jet::Entry* entry = gradient.extend(count_);
      for (std::size_t j = 0; j < count_; ++j) *entry++ = {columns_[j], number[1 + j]};
      sum = Jet(number[0], std::move(gradient));
    } else {
      const double* derivative = number + 1;
      for (const Jets* jets : {&state_, &parameter_}) {
        for (const Jet& from : *jets) {
          if (!from.gradient().empty()) sum = Jet::chain(sum, from, sum.value, 1.0, *derivative++);
        }
      }
    }
    return end_time.gradient().empty() ? sum : Jet::chain(sum, end_time, sum.value, 1.0, rate);
  }

 private:
  /// Columns ascend, and there are few.
  void add(int column) {
    const auto at = std::lower_bound(columns_.begin(), columns_.end(), column);
    if (at == columns_.end() || *at != column) columns_.insert(at, column);
  }
  void fill(const Jets& inputs, std::vector<double>& numbers, std::size_t& input) const {
    numbers.assign(inputs.size() * (1 + count_), 0.0);
    double* number = numbers.data();
    for (const Jet& jet : inputs) {
      number[0] = jet.value;
      if (by_column_) {
        std::size_t j = 0;
        for (const auto& entry : jet.gradient()) {
          while (columns_[j] != entry.column) ++j;
          number[1 + j] = entry.derivative;
        }
      } else if (!jet.gradient().empty()) {
        number[1 + input++] = 1.0;
      }
      number += 1 + count_;
    }
  }

  const Jets& state_;
  const Jets& parameter_;
  std::vector<int>& columns_;
  std::size_t count_ = 0;
  bool by_column_ = true;
};

void check_sizes(const ArcStart& start) {
  const auto check = [&](std::size_t given, int wanted, const char* what) {
    if (given != static_cast<std::size_t>(wanted))
      throw BadInput(fmt::format("arc {} starts with {} {}, its field has {}", start.arc + 1, given, what, wanted));
  };
  check(start.state.size(), start.field->states(), "states");
  check(start.quadrature.size(), start.field->quadratures(), "quadratures");
  check(start.parameter.size(), start.field->parameters(), "parameters");
}

}  // namespace

const char* describe(EventKind kind) {
  switch (kind) {
    case EventKind::fold: return "fold";
    case EventKind::arc_birth: return "arc birth";
    case EventKind::arc_death: return "arc death";
    case EventKind::limit: return "limit";
  }
  return "";
}

void FlowCache::set_options(const FlowOptions& options) {
  options_ = options;
  for (auto& [field, flow] : flows_) flow.set_options(options);
}

Flow& FlowCache::operator[](const Field& field) { return flows_.try_emplace(&field, field, options_).first->second; }

Statistics FlowCache::statistics() const {
  Statistics sum;
  for (const auto& [field, flow] : flows_) sum += flow.statistics();
  return sum;
}

void Shot::restart(std::span<const double> y, bool wants_reports) {
  if (y.size() != unknowns_.size() + nodes_.size()) throw InternalError("a shot is restarted with another number of values");
  for (std::size_t i = 0; i < y.size(); ++i) {
    (i < unknowns_.size() ? unknowns_[i] : nodes_[i - unknowns_.size()]).value = y[i];
  }
  wants_reports_ = wants_reports;
  replays_ = false;
  reached_.clear();
  begin();
}

void Shot::replay() {
  wants_reports_ = replays_ = true;
  begin();
}

void Shot::begin() {
  next_reached_ = 0;
  recorded_ = 0;
  next_node_ = 0;
  calls_ = 0;
  place_ = {};
  matches_.clear();
  reports_.clear();
  guards_.clear();
}

void Shot::finish() { arcs_.resize(recorded_); }

ArcEnd Shot::arc(const ArcStart& start) {
  check_sizes(start);
  place_ = {calls_++, 0};
  if (sketch_) return sketched(start);
  try {
    if (cuts_ == nullptr || place_.call >= cuts_->size() || (*cuts_)[place_.call].empty()) return integrate(start);
    ArcStart segment = start;
    const auto n = static_cast<std::size_t>(start.field->states());
    const auto k = static_cast<std::size_t>(start.field->quadratures());
    for (const double fraction : (*cuts_)[place_.call]) {
      segment.t1 = start.t0 + fraction * (start.t1 - start.t0);
      const ArcEnd end = integrate(segment);
      segment.state = node(n);
      segment.quadrature = node(k);
      for (std::size_t i = 0; i < n; ++i) matches_.push_back(end.state[i] - segment.state[i]);
      for (std::size_t i = 0; i < k; ++i) matches_.push_back(end.quadrature[i] - segment.quadrature[i]);
      segment.t0 = segment.t1;
      ++place_.segment;
    }
    segment.t1 = start.t1;
    return integrate(segment);
  } catch (const LeftDomain& failure) {
    throw LeftDomain(fmt::format("arc {}: {}", start.arc + 1, failure.what()));
  }
}

Jets Shot::node(std::size_t count) {
  const auto begin = nodes_.begin() + static_cast<std::ptrdiff_t>(next_node_);
  next_node_ += count;
  if (next_node_ > nodes_.size()) throw InternalError("an arc has more nodes than there are values for");
  return {begin, begin + static_cast<std::ptrdiff_t>(count)};
}

/// The next record, but for the end state.
ArcRecord& Shot::record(const ArcStart& start) {
  if (recorded_ == arcs_.size()) arcs_.emplace_back();
  ArcRecord& record = arcs_[recorded_++];
  record.arc = start.arc;
  record.place = place_;
  record.field = start.field;
  record.t0 = start.t0.value;
  record.t1 = start.t1.value;
  record.clock = start.clock;
  record.time_quadrature = start.time_quadrature;
  record.time_unit = 1.0;
  values(start.state, record.state);
  values(start.quadrature, record.quadrature);
  values(start.parameter, record.parameter);
  record.constants.clear();
  return record;
}

ArcEnd Shot::sketched(const ArcStart& start) {
  ArcEnd end{start.state, start.quadrature};
  if (const auto guess = sketch_(start.arc)) end.state.assign(guess->begin(), guess->end());
  values(end.state, record(start).end_state);
  return end;
}

/// f and q at the values of an arc, which are `stride` apart.
void Shot::rates(double t, const ArcStart& start, const double* state, std::size_t stride, double* result) const {
  const auto n = static_cast<std::size_t>(start.field->states()), k = static_cast<std::size_t>(start.field->quadratures());
  ShortVector<double, 16> z, p;
  for (std::size_t i = 0; i < n; ++i) z.push_back(state[i * stride]);
  for (const Jet& parameter : start.parameter) p.push_back(parameter.value);
  if (!start.field->variation(t, {z.data(), n}, {p.data(), p.size()}, 0, {result, n + k})) {
    throw LeftDomain(fmt::format("the right-hand side is not finite at t = {:.6g}", t));
  }
}

/// A later start is an earlier point of the same orbit: ∂z₁/∂t₀ = −Φ f(z₀), so a start time that moves z₀ by −f(z₀) need not move.
ArcStart Shot::moved(const ArcStart& start) const {
  ArcStart from = start;
  ShortVector<double, 16> z, rate(start.state.size() + start.quadrature.size());
  for (const Jet& value : start.state) z.push_back(value.value);
  rates(start.t0.value, start, z.data(), 1, rate.data());
  const double* next = rate.data();
  for (Jets* jets : {&from.state, &from.quadrature}) {
    for (Jet& jet : *jets) jet = Jet::chain(jet, start.t0, jet.value, 1.0, -*next++);
  }
  from.t0 = start.t0.value;
  return from;
}

ArcEnd Shot::integrate(const ArcStart& start) {
  if (!start.t0.gradient().empty()) return integrate(moved(start));
  const Field& field = *start.field;
  const auto n = static_cast<std::size_t>(field.states()), k = static_cast<std::size_t>(field.quadratures());
  const Seeding seeding(start.state, start.parameter, scratch_.columns);
  const std::size_t stride = 1 + seeding.count(), numbers = (n + k) * stride;
  if (!replays_) {
    seeding.lift(scratch_.state, scratch_.parameter);
    const auto end = (*flows_)[field].advance(start.t0.value, start.t1.value, scratch_.state, scratch_.parameter,
                                              static_cast<int>(seeding.count()));
    reached_.resize(next_reached_ + numbers + n + k);
    std::copy(end.begin(), end.end(), reached_.data() + next_reached_);
    if (!start.t1.gradient().empty()) {
      rates(start.t1.value, start, end.data(), stride, reached_.data() + next_reached_ + numbers);
    }
  }
  const double *reached = reached_.data() + next_reached_, *rate = reached + numbers;
  next_reached_ += numbers + n + k;
  ArcEnd end;
  for (std::size_t i = 0; i < n; ++i, reached += stride) end.state.push_back(seeding.jet(reached, start.t1, *rate++));
  for (std::size_t i = 0; i < k; ++i, reached += stride) {
    end.quadrature.push_back(start.quadrature[i] + seeding.jet(reached, start.t1, *rate++));
  }
  values(end.state, record(start).end_state);
  return end;
}

void Shot::complete(std::span<const double> origin, std::span<const double> constants, double time_unit) {
  for (std::size_t arc = 0; arc < recorded_; ++arc) {
    ArcRecord& record = arcs_[arc];
    record.constants.assign(constants.begin(), constants.end());
    record.time_unit = time_unit;
    for (std::size_t i = 0; i < origin.size(); ++i) record.quadrature[static_cast<Eigen::Index>(i)] += origin[i];
  }
}

}  // namespace costate
