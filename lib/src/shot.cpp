#include <costate/error.hpp>
#include <costate/shot.hpp>

#include <algorithm>
#include <fmt/format.h>

namespace costate {

namespace {

Eigen::VectorXd values(const std::vector<Jet>& jets) {
  Eigen::VectorXd v(static_cast<Eigen::Index>(jets.size()));
  for (Eigen::Index i = 0; i < v.size(); ++i) v[i] = jets[static_cast<std::size_t>(i)].value;
  return v;
}

/// The directions in which an arc must be differentiated, and the way back from them to the columns of the problem.
///
/// Either one direction per column that moves any input, or one per input that moves at all: whichever is fewer.
class Seeding {
 public:
  Seeding(const std::vector<Jet>& state, const std::vector<Jet>& parameter) : state_(&state), parameter_(&parameter) {
    for (const auto* inputs : {&state, &parameter}) {
      for (const Jet& input : *inputs) {
        if (!input.gradient().empty()) ++inputs_;
        for (const auto& entry : input.gradient()) columns_.push_back(entry.column);
      }
    }
    std::sort(columns_.begin(), columns_.end());
    columns_.erase(std::unique(columns_.begin(), columns_.end()), columns_.end());
    by_column_ = static_cast<Eigen::Index>(columns_.size()) <= inputs_;
  }

  [[nodiscard]] Directions directions() const {
    const Eigen::Index d = by_column_ ? static_cast<Eigen::Index>(columns_.size()) : inputs_;
    Directions r{Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(state_->size()), d),
                 Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(parameter_->size()), d)};
    Eigen::Index input = 0;
    fill(*state_, r.state, input);
    fill(*parameter_, r.parameter, input);
    return r;
  }

  /// value with the gradient that `derivative` (one row over the directions) implies.
  [[nodiscard]] Jet jet(double value, const Eigen::Ref<const Eigen::RowVectorXd>& derivative) const {
    if (by_column_) {
      Jet::Gradient gradient(columns_.size());
      for (std::size_t j = 0; j < columns_.size(); ++j) {
        gradient[j] = {columns_[j], derivative[static_cast<Eigen::Index>(j)]};
      }
      return {value, std::move(gradient)};
    }
    Jet sum(value);
    Eigen::Index input = 0;
    for (const auto* inputs : {state_, parameter_}) {
      for (const Jet& from : *inputs) {
        if (!from.gradient().empty()) sum += Jet::chain(from, 0.0, derivative[input++]);
      }
    }
    return sum;
  }

 private:
  void fill(const std::vector<Jet>& inputs, Eigen::MatrixXd& seeds, Eigen::Index& input) const {
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      if (inputs[i].gradient().empty()) continue;
      if (by_column_) {
        for (std::size_t j = 0; j < columns_.size(); ++j) {
          seeds(row, static_cast<Eigen::Index>(j)) = inputs[i].derivative(columns_[j]);
        }
      } else {
        seeds(row, input++) = 1.0;
      }
    }
  }

  const std::vector<Jet>* state_;
  const std::vector<Jet>* parameter_;
  std::vector<int> columns_;
  Eigen::Index inputs_ = 0;
  bool by_column_ = true;
};

ArcRecord record_of(const ArcStart& start, const SegmentPlace& place) {
  return {.arc = start.arc,
          .place = place,
          .field = start.field,
          .t0 = start.t0.value,
          .t1 = start.t1.value,
          .clock = start.clock,
          .time_quadrature = start.time_quadrature,
          .state = values(start.state),
          .quadrature = values(start.quadrature),
          .parameter = values(start.parameter),
          .end_state = {},
          .constants = {}};
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

ArcEnd Shot::arc(const ArcStart& start) {
  place_ = {calls_++, 0};
  if (sketch_) return sketched(start);
  try {
    if (cuts_ == nullptr || place_.call >= cuts_->size()) return integrate(start);
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

std::vector<Jet> Shot::node(std::size_t count) {
  const auto begin = nodes_.begin() + static_cast<std::ptrdiff_t>(next_node_);
  next_node_ += count;
  if (next_node_ > nodes_.size()) throw InternalError("an arc has more nodes than there are values for");
  return {begin, begin + static_cast<std::ptrdiff_t>(count)};
}

ArcEnd Shot::sketched(const ArcStart& start) {
  ArcRecord record = record_of(start, place_);
  ArcEnd end{start.state, start.quadrature};
  if (const auto guess = sketch_(start.arc)) end.state.assign(guess->begin(), guess->end());
  record.end_state = values(end.state);
  arcs_.push_back(std::move(record));
  return end;
}

ArcEnd Shot::integrate(const ArcStart& start) {
  const Field& field = *start.field;
  ArcRecord record = record_of(start, place_);
  // A later start is an earlier point of the same orbit: ∂z₁/∂t₀ = −Φ f(z₀), so the start time moves z₀ by −f(z₀).
  std::vector<Jet> state = start.state;
  std::vector<Jet> quadrature = start.quadrature;
  if (!start.t0.gradient().empty()) {
    Eigen::VectorXd dz(field.states());
    Eigen::VectorXd dw(field.quadratures());
    if (!field.rates(record.t0, record.state, record.parameter, dz, dw)) {
      throw LeftDomain(fmt::format("the right-hand side is not finite at t = {:.6g}", record.t0));
    }
    const Jet moved(0.0, start.t0.gradient());
    for (std::size_t i = 0; i < state.size(); ++i) state[i] -= moved * dz[static_cast<Eigen::Index>(i)];
    for (std::size_t i = 0; i < quadrature.size(); ++i) quadrature[i] -= moved * dw[static_cast<Eigen::Index>(i)];
  }
  const Seeding seeding(state, start.parameter);
  const Jet elapsed(0.0, start.t1.gradient());
  const FlowEnd& end = (*flows_)[field].run(record.t0, record.t1, record.state, record.parameter, seeding.directions());
  ArcEnd result;
  for (Eigen::Index i = 0; i < end.state.size(); ++i) {
    result.state.push_back(seeding.jet(end.state[i], end.state_directions.row(i)) + elapsed * end.state_rate[i]);
  }
  for (Eigen::Index i = 0; i < end.quadrature.size(); ++i) {
    result.quadrature.push_back(quadrature[static_cast<std::size_t>(i)] +
                                seeding.jet(end.quadrature[i], end.quadrature_directions.row(i)) +
                                elapsed * end.quadrature_rate[i]);
  }
  record.end_state = end.state;
  arcs_.push_back(std::move(record));
  return result;
}

void Shot::complete(const std::vector<double>& origin, const std::vector<double>& constants, double time_unit) {
  for (ArcRecord& record : arcs_) {
    record.constants = constants;
    record.time_unit = time_unit;
    for (std::size_t i = 0; i < origin.size(); ++i) record.quadrature[static_cast<Eigen::Index>(i)] += origin[i];
  }
}

}  // namespace costate
