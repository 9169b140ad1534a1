/// \file
/// Where arcs are cut for multiple shooting. Private to the shooting library.
///
/// A segment may magnify what it starts from by no more than a bound, max |Φᵢⱼ| sⱼ/sᵢ in the magnitudes s that the states have on the arc: rounding and
/// integration errors then stay errors, and Newton's method sees a function it can linearise (Ascher, Mattheij & Russell, Numerical
/// Solution of Boundary Value Problems for ODEs, 1995, §4.3).
#pragma once

#include <costate/shooting/shooting.hpp>

namespace costate {

struct MeshOptions {
  double growth = 1e3;      ///< bound for one segment; the smaller, the more Newton's method can linearise
  int max_segments = 4000;  ///< of all arcs together
};

/// Cuts along the states of a start, as far as a segment can be integrated from the guess with
/// bounded growth and does not leave it by more than a hundred times the scale. Arcs without such states are not cut. An arc that needs
/// no cut stays whole. \throws LeftDomain if the arcs cannot be sketched
[[nodiscard]] Mesh mesh_along_guess(Shooting& shooting, const Start& start, const MeshOptions& options);

/// Can every arc be integrated as a whole from the states of a start, with bounded growth and without leaving them as above? Yes where
/// nothing is known. \throws LeftDomain if the arcs cannot be sketched
[[nodiscard]] bool can_stay_whole(Shooting& shooting, const Start& start, const MeshOptions& options);

/// Cuts along the arcs at y, which can be integrated as they are cut now: segments that together grow less than the bound become
/// one, those that grow more are cut. \throws LeftDomain
[[nodiscard]] Mesh remesh(Shooting& shooting, const Eigen::VectorXd& y, const MeshOptions& options);

/// The cuts at y and one more, in the middle of a segment, where it arrives there from its start. \throws LeftDomain
[[nodiscard]] Mesh split(Shooting& shooting, const Eigen::VectorXd& y, const SegmentPlace& place);

/// The largest growth of a segment at y. \throws LeftDomain
[[nodiscard]] double largest_growth(Shooting& shooting, const Eigen::VectorXd& y);

/// Cuts the arcs of the shooting, and puts the nodes behind the problem's unknowns in y.
void apply(const Mesh& mesh, Shooting& shooting, Eigen::VectorXd& y);

}  // namespace costate
