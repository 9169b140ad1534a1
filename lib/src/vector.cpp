#include "vector.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>

// Results may be operands, element by element: no loop carries a value from one element to another.
#define COSTATE_ELEMENTWISE _Pragma("GCC ivdep")

namespace costate::sundials {

namespace {

constexpr std::size_t alignment = 64;
constexpr sunindextype word = 4;  // doubles that are treated at a time

/// Begins as the content of a serial vector.
struct alignas(alignment) Content {
  _N_VectorContent_Serial serial;
  sunindextype padded, rows, columns;
};
static_assert(std::is_standard_layout_v<Content>);

Content& content(N_Vector v) { return *static_cast<Content*>(v->content); }
double* data(N_Vector v) { return content(v).serial.data; }

/// A vector without operations, or null where there is no memory.
N_Vector allocate(sunindextype rows, sunindextype columns, SUNContext context) {
  const sunindextype length = rows * columns, padded = (length + word - 1) / word * word;
  const auto bytes = sizeof(Content) + static_cast<std::size_t>(padded) * sizeof(double);
  void* block = ::operator new (bytes, std::align_val_t{alignment}, std::nothrow);
  if (block == nullptr) return nullptr;
  N_Vector v = N_VNewEmpty(context);
  if (v == nullptr) {
    ::operator delete (block, std::align_val_t{alignment});
    return nullptr;
  }
  auto* numbers = reinterpret_cast<double*>(static_cast<char*>(block) + sizeof(Content));
  v->content = new (block) Content{{length, SUNFALSE, numbers}, padded, rows, columns};
  std::fill_n(numbers, padded, 0.0);
  return v;
}

void destroy(N_Vector v) {
  if (v == nullptr) return;
  ::operator delete (v->content, std::align_val_t{alignment});
  v->content = nullptr;
  N_VFreeEmpty(v);
}

N_Vector clone(N_Vector like) {
  N_Vector v = allocate(content(like).rows, content(like).columns, like->sunctx);
  if (v != nullptr && N_VCopyOps(like, v) != 0) {
    destroy(v);
    return nullptr;
  }
  return v;
}

template <class Operation>
void each(sunindextype size, Operation&& operation) {
  COSTATE_ELEMENTWISE
  for (sunindextype i = 0; i < size; ++i) operation(i);
}
template <class Operation>
void each(N_Vector v, Operation&& operation) {
  const sunindextype size = content(v).padded;
  for (sunindextype begin = 0; begin < size; begin += word) {
    COSTATE_ELEMENTWISE
    for (sunindextype i = begin; i < begin + word; ++i) operation(i);
  }
}

void linear_sum(double a, N_Vector x, double b, N_Vector y, N_Vector z) {
  const double *from = data(x), *and_from = data(y);
  double* to = data(z);
  each(z, [=](sunindextype i) { to[i] = a * from[i] + b * and_from[i]; });
}
void scale(double c, N_Vector x, N_Vector z) {
  const double* from = data(x);
  double* to = data(z);
  each(z, [=](sunindextype i) { to[i] = c * from[i]; });
}
void absolute_value(N_Vector x, N_Vector z) {
  const double* from = data(x);
  double* to = data(z);
  each(z, [=](sunindextype i) { to[i] = std::abs(from[i]); });
}
void product(N_Vector x, N_Vector y, N_Vector z) {
  const double *from = data(x), *and_from = data(y);
  double* to = data(z);
  each(z, [=](sunindextype i) { to[i] = from[i] * and_from[i]; });
}
// What would not leave the padding zero stops at the length.
void constant(double c, N_Vector z) {
  double* to = data(z);
  each(content(z).serial.length, [=](sunindextype i) { to[i] = c; });
}
void quotient(N_Vector x, N_Vector y, N_Vector z) {
  const double *from = data(x), *by = data(y);
  double* to = data(z);
  each(content(z).serial.length, [=](sunindextype i) { to[i] = from[i] / by[i]; });
}
void inverse(N_Vector x, N_Vector z) {
  const double* from = data(x);
  double* to = data(z);
  each(content(z).serial.length, [=](sunindextype i) { to[i] = 1.0 / from[i]; });
}
void add_constant(N_Vector x, double b, N_Vector z) {
  const double* from = data(x);
  double* to = data(z);
  each(content(z).serial.length, [=](sunindextype i) { to[i] = from[i] + b; });
}

double max_norm(N_Vector x) {
  const double* from = data(x);
  double largest = 0.0;
  for (sunindextype i = 0; i < content(x).serial.length; ++i) largest = std::max(largest, std::abs(from[i]));
  return largest;
}
double minimum(N_Vector x) {
  const double* from = data(x);
  return *std::min_element(from, from + content(x).serial.length);
}
double dot(N_Vector x, N_Vector y) {
  const double *from = data(x), *with = data(y);
  double sum = 0.0;
  for (sunindextype i = 0; i < content(x).serial.length; ++i) sum += from[i] * with[i];
  return sum;
}
double weighted_norm(N_Vector x, N_Vector w) {
  const double *from = data(x), *weight = data(w);
  double sum = 0.0;
  for (sunindextype i = 0; i < content(x).serial.length; ++i) sum += from[i] * weight[i] * (from[i] * weight[i]);
  return std::sqrt(sum);
}

/// The larger of two, or the one that is not a number.
double larger(double a, double b) { return b > a || b != b ? b : a; }

/// The largest Σᵢ (xᵢⱼ wᵢⱼ)² of the columns first … first + width − 1.
template <int width>
double largest_square(const double* from, const double* weight, sunindextype rows, sunindextype columns) {
  double sums[width] = {};
  for (sunindextype row = 0; row < rows; ++row, from += columns, weight += columns) {
    for (int j = 0; j < width; ++j) sums[j] += from[j] * weight[j] * (from[j] * weight[j]);
  }
  double largest = sums[0];
  for (int j = 1; j < width; ++j) largest = larger(largest, sums[j]);
  return largest;
}

double rms_norm(N_Vector x, N_Vector w) {
  const sunindextype rows = content(x).rows, columns = content(x).columns;
  const double *from = data(x), *weight = data(w);
  double largest = 0.0;
  switch (columns) {
    case 1: largest = largest_square<1>(from, weight, rows, 1); break;
    case 2: largest = largest_square<2>(from, weight, rows, 2); break;
    case 3: largest = largest_square<3>(from, weight, rows, 3); break;
    case 4: largest = largest_square<4>(from, weight, rows, 4); break;
    case 5: largest = largest_square<5>(from, weight, rows, 5); break;
    default:
      for (sunindextype j = 0; j < columns; ++j) {
        largest = larger(largest, largest_square<1>(from + j, weight + j, rows, columns));
      }
  }
  return std::sqrt(largest / static_cast<double>(rows));
}

int linear_combination(int count, double* c, N_Vector* x, N_Vector z) {
  double* to = data(z);
  // Any operand may be the result: an element is written after all have been read.
  for (sunindextype i = 0; i < content(z).padded; ++i) {
    double sum = 0.0;
    for (int k = 0; k < count; ++k) sum += c[k] * data(x[k])[i];
    to[i] = sum;
  }
  return 0;
}
int scale_add_multi(int count, double* a, N_Vector x, N_Vector* y, N_Vector* z) {
  for (int k = 0; k < count; ++k) linear_sum(a[k], x, 1.0, y[k], z[k]);
  return 0;
}

// Arrays of vectors: the sensitivities.
int linear_sum_array(int count, double a, N_Vector* x, double b, N_Vector* y, N_Vector* z) {
  for (int j = 0; j < count; ++j) linear_sum(a, x[j], b, y[j], z[j]);
  return 0;
}
int scale_array(int count, double* c, N_Vector* x, N_Vector* z) {
  for (int j = 0; j < count; ++j) scale(c[j], x[j], z[j]);
  return 0;
}
int constant_array(int count, double c, N_Vector* z) {
  for (int j = 0; j < count; ++j) constant(c, z[j]);
  return 0;
}
int rms_norm_array(int count, N_Vector* x, N_Vector* w, double* norms) {
  for (int j = 0; j < count; ++j) norms[j] = rms_norm(x[j], w[j]);
  return 0;
}
int scale_add_multi_array(int count, int sums, double* a, N_Vector* x, N_Vector** y, N_Vector** z) {
  for (int k = 0; k < sums; ++k) {
    for (int j = 0; j < count; ++j) linear_sum(a[k], x[j], 1.0, y[k][j], z[k][j]);
  }
  return 0;
}

void set_operations(_generic_N_Vector_Ops& ops) {
  ops.nvgetvectorid = [](N_Vector) { return SUNDIALS_NVEC_SERIAL; };
  ops.nvclone = clone;
  ops.nvdestroy = destroy;
  ops.nvgetarraypointer = data;
  ops.nvgetlength = [](N_Vector v) { return content(v).serial.length; };
  ops.nvlinearsum = linear_sum;
  ops.nvconst = constant;
  ops.nvprod = product;
  ops.nvdiv = quotient;
  ops.nvscale = scale;
  ops.nvabs = absolute_value;
  ops.nvinv = inverse;
  ops.nvaddconst = add_constant;
  ops.nvdotprod = dot;
  ops.nvmaxnorm = max_norm;
  ops.nvmin = minimum;
  ops.nvwrmsnorm = rms_norm;
  ops.nvwl2norm = weighted_norm;
  ops.nvlinearcombination = linear_combination;
  ops.nvscaleaddmulti = scale_add_multi;
  ops.nvlinearsumvectorarray = linear_sum_array;
  ops.nvscalevectorarray = scale_array;
  ops.nvconstvectorarray = constant_array;
  ops.nvwrmsnormvectorarray = rms_norm_array;
  ops.nvscaleaddmultivectorarray = scale_add_multi_array;
}

}  // namespace

Vector make_vector(int rows, int columns, SUNContext context) {
  Vector v = owned(allocate(rows, columns, context), "N_VNewEmpty");
  set_operations(*v->ops);
  return v;
}

bool set_weights(N_Vector y, double relative, const double* absolute, N_Vector w) {
  const sunindextype rows = content(y).rows, columns = content(y).columns;
  const double* from = data(y);
  double* to = data(w);
  double smallest = std::numeric_limits<double>::infinity();
  for (sunindextype row = 0; row < rows; ++row, from += columns, to += columns) {
    for (sunindextype j = 0; j < columns; ++j) {
      const double error = relative * std::abs(from[j]) + absolute[j];
      smallest = std::min(smallest, error);
      to[j] = 1.0 / error;
    }
  }
  return smallest > 0.0;
}

}  // namespace costate::sundials
