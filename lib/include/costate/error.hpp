/// \file
/// The ways in which something can be wrong, each a type of its own. A solve that does not converge is none of them:
/// it is a value (see Solution).
#pragma once

#include <stdexcept>
#include <string>

namespace costate {

/// A value given by the caller is not admissible; the message names it, its value and the admissible range with its unit.
class BadInput : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

/// An evaluation left the domain of the model (a root of a negative number, a blow-up, too many steps). Recoverable: a Newton
/// step that runs into it is shortened; the message says where it happened.
class LeftDomain : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A computation has cost all it was allowed to; the message says how much. Not recoverable: whoever set the limit catches it.
class BudgetSpent : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A library call failed in a way no input should be able to cause.
class InternalError : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

}  // namespace costate
