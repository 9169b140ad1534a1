/// \file
/// The Runge–Kutta pair of orders 8 and 7 with 13 stages that J. H. Verner calls his most efficient one: Numerically optimal
/// Runge–Kutta pairs with interpolants, Numer. Algorithms 53 (2010) 383–396. Private to lib.
#pragma once

#include <array>

namespace costate::verner {

inline constexpr int stages = 13;
/// Order of what is propagated; the embedded formula's is one less, and its error per step is of this order.
inline constexpr int order = 8;

using Row = std::array<double, stages>;

/// c: stage s is at t + c[s] h.
inline constexpr Row nodes = {0,     0.05, 0.1065625, 0.15984375, 0.39, 0.465, 0.155, 0.943, 0.901802041735857,
                              0.909, 0.94, 1,         1};

/// a: stage s is at y + h Σ a[s][j] k[j]. The last two stages are both at t + h, and neither is the result.
inline constexpr std::array<Row, stages> matrix = {{
    {},
    {0.05},
    {-0.0069931640625, 0.1135556640625},
    {0.0399609375, 0, 0.1198828125},
    {0.36139756280045754, 0, -1.3415240667004928, 1.3701265039000352},
    {0.049047202797202795, 0, 0, 0.23509720422144048, 0.18085559298135673},
    {0.06169289044289044, 0, 0, 0.11236568314640277, -0.03885046071451367, 0.01979188712522046},
    {-1.767630240222327, 0, 0, -62.5, -6.061889377376669, 5.6508231982227635, 65.62169641937624},
    {-1.1809450665549708, 0, 0, -41.50473441114321, -4.434438319103725, 4.260408188586133, 43.75364022446172,
     0.00787142548991231},
    {-1.2814059994414884, 0, 0, -45.047139960139866, -4.731362069449577, 4.514967016593808, 47.44909557172985,
     0.010592282971116612, -0.0057468422638446166},
    {-1.7244701342624853, 0, 0, -60.92349008483054, -5.951518376222393, 5.556523730698456, 63.98301198033305,
     0.014642028250414961, 0.06460408772358203, -0.0793032316900888},
    {-3.301622667747079, 0, 0, -118.01127235975251, -10.141422388456112, 9.139311332232058, 123.37594282840426,
     4.62324437887458, -3.3832777380682018, 4.527592100324618, -5.828495485811623},
    {-3.039515033766309, 0, 0, -109.26086808941763, -9.290642497400293, 8.43050498176491, 114.20100103783314,
     -0.9637271342145479, -5.0348840888021895, 5.958130824002923},
}};

/// b: the result is y + h Σ b[s] k[s].
inline constexpr Row weights = {0.04427989419007951,
                                0,
                                0,
                                0,
                                0,
                                0.3541049391724449,
                                0.2479692154956438,
                                -15.694202038838084,
                                25.084064965558564,
                                -31.738367786260277,
                                22.938283273988784,
                                -0.2361324633071542,
                                0};

/// The weights of the embedded formula.
inline constexpr Row embedded = {0.044312615229089795,
                                 0,
                                 0,
                                 0,
                                 0,
                                 0.35460956423432266,
                                 0.2478480431366653,
                                 4.4481347324757845,
                                 19.846886366118735,
                                 -23.58162337746562,
                                 0,
                                 0,
                                 -0.36016794372897754};

/// What h Σ errors[s] k[s] weighs: the difference of the two results.
inline constexpr Row errors = [] {
  Row difference{};
  for (std::size_t s = 0; s < stages; ++s) difference[s] = weights[s] - embedded[s];
  return difference;
}();

/// z' = λz decays along with its solution as long as −h λ is below this, for real λ < 0.
inline constexpr double real_stability = 5.86;

}  // namespace costate::verner
