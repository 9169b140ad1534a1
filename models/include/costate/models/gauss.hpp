/// \file
/// Gauss's rules with eight and with four nodes on (−1, 1).
#pragma once

#include <array>

namespace costate {

/// The positive nodes and their weights; the rule is symmetric. (Abramowitz & Stegun 1964, table 25.4.)
inline constexpr std::array<std::array<double, 2>, 4> gauss{{{0.1834346424956498, 0.3626837833783620},
                                                             {0.5255324099163290, 0.3137066458778873},
                                                             {0.7966664774136267, 0.2223810344533745},
                                                             {0.9602898564975363, 0.1012285362903763}}};

inline constexpr std::array<std::array<double, 2>, 2> gauss_4{{{0.3399810435848563, 0.6521451548625461},
                                                               {0.8611363115940526, 0.3478548451374538}}};

}  // namespace costate
