/// \file
/// Vectors of SUNDIALS with operations of our own. Private to lib.
///
/// Debian builds SUNDIALS without optimisation, and an operation on the dozen numbers of an arc costs more there than the right-hand
/// side. The operations here are compiled with the rest of the library. A vector is one aligned block, padded with zeros to a whole
/// number of SIMD words so that element-wise loops have no remainder; its content begins as that of the serial vector does, which
/// makes it one for everything that works on serial vectors (SUNDIALS' dense solver).
#pragma once

#include "sundials.hpp"

namespace costate::sundials {

/// A vector of `rows` numbers, each followed by columns − 1 derivatives, all zero. Clones have its shape and its operations.
///
/// The weighted root mean square norm is the largest of those of the columns: the state and each of its derivatives are under error
/// control for themselves, as with CVODES' forward sensitivities. For columns = 1 it is the usual one.
[[nodiscard]] Vector make_vector(int rows, int columns, SUNContext context);

/// wᵢ = 1/(relative·|yᵢ| + aⱼ) with the absolute tolerance aⱼ of i's column. Returns false where a weight is not positive and finite.
bool set_weights(N_Vector y, double relative, const double* absolute, N_Vector w);

}  // namespace costate::sundials
