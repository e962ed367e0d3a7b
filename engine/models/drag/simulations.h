// Drag laws fitted to resolved simulations of flow through random arrays of fixed spheres.
//
// They are published as F, a force over 3π μ d times the superficial velocity ε v. With φ = 1 − ε, the force of the gas without
// that of the mean pressure gradient (model A) is
//   b = 3π μ d ε F    where F is already without it,       b = 3π μ d ε² F    where F holds it: the total is 1/ε times the drag.
#pragma once

#include <algorithm>
#include <cmath>

#include "base/elementary.h"
#include "models/drag/scene.h"

namespace bedflow {

// Hill, Koch & Ladd (2001), J. Fluid Mech. 448, 213 and 243, total force, in the corrected and extended set of Benyahia, Syamlal
// & O'Brien (2006), Powder Technol. 162, 166. Re = ρg ε d v/2μ is of the radius.
//   φ ≤ 0.01:  F = 1 + ⅜ Re     up to where that meets F2 + F3 Re, which holds beyond
//   else:      F = F0 + F1 Re²  up to where that meets F2 + F3 Re, which holds beyond
//   F0 = (1−w) (1 + 3√(φ/2) + (135/64) φ ln φ + 17.14 φ)/(1 + 0.681 φ −  8.48 φ² +  8.16 φ³) + w 10 φ/ε³
//   F2 = (1−w) (1 + 3√(φ/2) + (135/64) φ ln φ + 17.89 φ)/(1 + 0.681 φ − 11.03 φ² + 15.41 φ³) + w 10 φ/ε³
//   w = exp(−10 (0.4 − φ)/φ), 1 from φ = 0.4 on
//   F1 = √(2/φ)/40 (φ ≤ 0.1)  or  0.11 + 0.00051 e^(11.6 φ)
//   F3 = 0.9351 φ + 0.03667 (φ < 0.0953)  or  0.0673 + 0.212 φ + 0.0232/ε⁵
// (17.14 − 0.681 is 16.456, the coefficient that Kim & Russel (1985) derived for dilute arrays.)
struct KochHill {
  static constexpr const char* name = "koch_hill";
  double operator()(const DragScene& s, double slip, double fraction) const {
    const double reynolds = 0.5 * s.reynolds(fraction * slip), phi = std::max(1 - fraction, 1e-12);
    const double phi2 = phi * phi, phi3 = phi2 * phi, e2 = fraction * fraction, e3 = e2 * fraction;
    const double common = 1 + 3 * std::sqrt(phi / 2) + 135.0 / 64 * logarithm(phi) * phi;
    const double w = phi < 0.4 ? exponential(-10 * (0.4 - phi) / phi) : 1;
    const double packed = w * 10 * phi / e3;
    const double f0 = (1 - w) * (common + 17.14 * phi) / (1 + 0.681 * phi - 8.48 * phi2 + 8.16 * phi3) + packed;
    const double f1 = phi <= 0.1 ? std::sqrt(2 / phi) / 40 : 0.11 + 0.00051 * exponential(11.6 * phi);
    const double f2 = (1 - w) * (common + 17.89 * phi) / (1 + 0.681 * phi - 11.03 * phi2 + 15.41 * phi3) + packed;
    const double f3 = phi < 0.0953 ? 0.9351 * phi + 0.03667 : 0.0673 + 0.212 * phi + 0.0232 / (e2 * e3);
    const double meet = phi <= 0.01 ? (f2 - 1) / (0.375 - f3) : (f3 + std::sqrt(f3 * f3 - 4 * f1 * (f0 - f2))) / (2 * f1);
    const double slow = phi <= 0.01 ? 1 + 0.375 * reynolds : f0 + f1 * reynolds * reynolds;
    return s.stokes() * e2 * (reynolds <= meet ? slow : f2 + f3 * reynolds);
  }
};

// Beetstra, van der Hoef & Kuipers (2007), AIChE J. 53, 489, for one size; F without the mean pressure gradient.
//   F = 10 φ/ε² + ε² (1 + 1.5 √φ) + 0.413 Re/(24 ε²) · (1/ε + 3 ε φ + 8.4 Re^−0.343)/(1 + 10^(3φ) Re^−(1+4φ)/2),   Re = ρg ε d
//   v/μ
struct Beetstra {
  static constexpr const char* name = "beetstra";
  double operator()(const DragScene& s, double slip, double fraction) const {
    const double reynolds = s.reynolds(fraction * slip), phi = std::max(1 - fraction, 0.0), e2 = fraction * fraction;
    const double slow = 10 * phi / e2 + e2 * (1 + 1.5 * std::sqrt(phi));
    const double inertia = reynolds * (1 / fraction + 3 * fraction * phi) + 8.4 * power(reynolds, 0.657);
    const double damping = power(reynolds, 0.5 * (1 + 4 * phi));
    const double grown = 0.413 / (24 * e2) * inertia * damping / (damping + exponential(3 * std::numbers::ln10 * phi));
    return s.stokes() * fraction * (slow + grown);
  }
};

// Tenneti, Garg & Subramaniam (2011), Int. J. Multiphase Flow 37, 1072; total force. Re = ρg ε d v/μ.
//   F = (1 + 0.15 Re^0.687)/ε³ + 5.81 φ/ε³ + 0.48 φ^⅓/ε⁴ + φ³ Re (0.95 + 0.61 φ³/ε²)
struct Tenneti {
  static constexpr const char* name = "tenneti";
  double operator()(const DragScene& s, double slip, double fraction) const {
    const double reynolds = s.reynolds(fraction * slip), phi = std::max(1 - fraction, 0.0);
    const double e2 = fraction * fraction, e3 = e2 * fraction, phi3 = phi * phi * phi;
    const double total = (1 + 0.15 * power(reynolds, 0.687) + 5.81 * phi) / e3 + 0.48 * power(phi, 1.0 / 3) / (e2 * e2) +
                         phi3 * reynolds * (0.95 + 0.61 * phi3 / e2);
    return s.stokes() * e2 * total;
  }
};

}  // namespace bedflow
