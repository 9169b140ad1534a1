/// \file
/// All that a page of one's own needs: state a problem (ControlProblem, TwoPoint), solve it, search for all its extremals, follow it in
/// a parameter, print what came out.
#pragma once

#include <costate/control_problem.hpp>
#include <costate/error.hpp>
#include <costate/shooting/branch.hpp>
#include <costate/shooting/print.hpp>
#include <costate/shooting/search.hpp>
#include <costate/shooting/solve.hpp>
#include <costate/two_point.hpp>
