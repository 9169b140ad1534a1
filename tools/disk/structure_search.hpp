/// \file
/// Following the friction coefficient down, arc by arc.
#pragma once

#include <costate/models/disk.hpp>
#include <costate/shooting/continuation.hpp>
#include <costate/shooting/solve.hpp>

namespace costate::disk {

/// Finds the arcs of a scene whose friction limit binds, starting from its unlimited solution.
///
/// One point is kept: a structure, its unknowns, a friction coefficient. Each stage follows the coefficient towards the
/// scene's until the structure no longer fits (a free end uses more than the limit, an arc has no duration left), changes
/// the structure there, and goes on.
class StructureSearch {
 public:
  /// `free` is the solution with unlimited friction; the scene's coefficient is below what it uses.
  /// What the search costs, seconds excepted, is added to `cost`, which must outlive it.
  StructureSearch(const Scene& scene, const Solution& free, const SolveOptions& options, Cost& cost);

  /// The scene's solution, or a failed one that says where the search ended.
  [[nodiscard]] Solution run();

 private:
  struct FreePoint;

  [[nodiscard]] bool fits(const Shot& shot, const Eigen::VectorXd& y, double friction) const;
  /// Changes the structure; returns why that is not possible, or nothing.
  [[nodiscard]] std::string restructure(const std::vector<ArcRecord>& records);
  void insert_at_ends(const ArcRecord& free);
  void insert_inside(const ArcRecord& free);
  void drop_free_arc(const ArcRecord& free);
  [[nodiscard]] double duration(const Eigen::VectorXd& y, std::size_t arc) const;
  [[nodiscard]] Solution failed(const std::string& why) const;

  /// What a change of structure started from, for another try with a smaller birth.
  struct Before {
    Structure arcs;
    Eigen::VectorXd y;
    double friction;
    std::vector<ArcRecord> records;
  };
  [[nodiscard]] std::string change(const std::vector<ArcRecord>& records);
  bool try_smaller_birth();

  Scene scene_;
  SolveOptions options_;
  double unit_;  ///< friction coefficient of scaled friction 1: c₁²/(g L)
  Structure arcs_;
  Eigen::VectorXd y_;
  double friction_;  ///< coefficient at which (arcs_, y_) holds
  double birth_;     ///< part of a free arc that a saturated one may take at its birth
  std::optional<Before> before_;
  Cost& cost_;
};

}  // namespace costate::disk
