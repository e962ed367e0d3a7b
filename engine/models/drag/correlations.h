// Drag laws fitted to experiments: settling and fluidization of suspensions, flow through packed beds, single spheres.
#pragma once

#include <cmath>
#include <numbers>

#include "base/elementary.h"
#include "models/drag/scene.h"

namespace bedflow {

// Schiller & Naumann (1933), Z. Ver. Dtsch. Ing. 77, 318: a single sphere; no ε. Newton's C_D = 0.44 beyond Re = 1000.
//   Re = ρg d v/μ       Re ≤ 1000:  b = 3π μ d (1 + 0.15 Re^0.687)        else:  b = ½·0.44 ρg v π r²
struct SchillerNaumann {
  static constexpr const char* name = "schiller_naumann";
  double operator()(const DragScene& s, double slip, double /*fraction*/) const {
    const double reynolds = s.reynolds(slip);
    const double viscous = s.stokes() * (1 + 0.15 * power(reynolds, 0.687));
    const double inertial = 0.055 * std::numbers::pi * s.density * slip * s.diameter * s.diameter;
    return reynolds <= 1000 ? viscous : inertial;
  }
};

// Wen & Yu (1966), Chem. Eng. Prog. Symp. Ser. 62, 100, with the factor ε^−1.65 on C_D of Schiller & Naumann.
//   Re = ρg ε d v/μ     Re ≤ 1000:  b = 3π μ d (1 + 0.15 Re^0.687) ε^−2.65        else:  b = ½·0.44 ρg v π r² ε^−1.65
struct WenYu {
  static constexpr const char* name = "wen_yu";
  double operator()(const DragScene& s, double slip, double fraction) const {
    return power(fraction, -2.65) * SchillerNaumann{}(s, fraction * slip, 1);
  }
};

// Ergun (1952), Chem. Eng. Prog. 48, 89, with his 150 and 1.75, per particle. His pressure drop is n b v/ε (n particles a
// volume):
//   b = 25π μ d (1−ε)/ε + (7π/24) ρg d² v
struct Ergun {
  static constexpr const char* name = "ergun";
  double operator()(const DragScene& s, double slip, double fraction) const {
    return 25 * std::numbers::pi * s.viscosity * s.diameter * (1 - fraction) / fraction +
           7 * std::numbers::pi / 24 * s.density * s.diameter * s.diameter * slip;
  }
};

// Gidaspow (1994), Multiphase Flow and Fluidization; Ding & Gidaspow (1990), AIChE J. 36, 523: b_Ergun below ε = 0.8, b_WenYu
// from there on. Two laws that do not meet: b jumps.
struct Gidaspow {
  static constexpr const char* name = "gidaspow";
  double operator()(const DragScene& s, double slip, double fraction) const {
    const double dilute = WenYu{}(s, slip, fraction), dense = Ergun{}(s, slip, fraction);
    return fraction < 0.8 ? dense : dilute;
  }
};

// The same, blended as by Lathouwers & Bellan (2001), Int. J. Multiphase Flow 27, 2155:
//   b = χ b_WenYu + (1−χ) b_Ergun,   χ = arctan(150·1.75 (ε − 0.8))/π + ½
struct GidaspowBlended {
  static constexpr const char* name = "gidaspow_blended";
  double operator()(const DragScene& s, double slip, double fraction) const {
    const double blend = arctangent(150 * 1.75 * (fraction - 0.8)) * std::numbers::inv_pi + 0.5;
    return blend * WenYu{}(s, slip, fraction) + (1 - blend) * Ergun{}(s, slip, fraction);
  }
};

// Dalla Valle's (1948) drag of a single sphere without the division by its speed: C_D = (0.63 + 4.8 Re^−½)², so that
//   (π/8) ρg d² C_D v = (π/8) μ d (0.63 Re^½ + 4.8)²,
// which tends to 0.96 of Stokes' drag.
inline double dalla_valle(const DragScene& s, double reynolds) {
  const double root = 0.63 * std::sqrt(reynolds) + 4.8;
  return std::numbers::pi / 8 * s.viscosity * s.diameter * root * root;
}

// Di Felice (1994), Int. J. Multiphase Flow 20, 153. A particle in a suspension feels ε^−β times the drag of a single one at the
// same superficial velocity ε v; his force balance has the buoyancy of the mixture, so b is that of model A as it stands:
//   b = (π/8) ρg d² C_D ε² v ε^−β,   β = 3.7 − 0.65 exp(−(1.5 − log10 Re)²/2),   Re = ρg ε d v/μ,   C_D of Dalla Valle
struct DiFelice {
  static constexpr const char* name = "di_felice";
  double operator()(const DragScene& s, double slip, double fraction) const {
    const double reynolds = s.reynolds(fraction * slip);
    const double from_middle = 1.5 - logarithm(reynolds) / std::numbers::ln10;
    const double beta = 3.7 - 0.65 * exponential(-0.5 * from_middle * from_middle);
    return fraction * power(fraction, -beta) * dalla_valle(s, reynolds);
  }
};

// Syamlal & O'Brien (1987), DOE report; Syamlal, Rogers & O'Brien (1993), MFIX theory guide. From the terminal velocity in a
// suspension over that of a single particle, V_r, by Garside & Al-Dibouni (1977); model A. Re is of the slip itself.
//   b = (π/8) ε ρg d² C_D(Re/V_r) v / V_r²,   Re = ρg d v/μ,   C_D of Dalla Valle
//   V_r = ½ [A − 0.06 Re + √((0.06 Re)² + 0.12 Re (2B − A) + A²)],   A = ε^4.14,   B = 0.8 ε^1.28 (ε ≤ 0.85) or ε^2.65
struct SyamlalObrien {
  static constexpr const char* name = "syamlal_obrien";
  double operator()(const DragScene& s, double slip, double fraction) const {
    const double reynolds = s.reynolds(slip), x = 0.06 * reynolds;
    const double dense = 0.8 * power(fraction, 1.28), dilute = power(fraction, 2.65);
    const double a = power(fraction, 4.14), b = fraction <= 0.85 ? dense : dilute;
    const double ratio = 0.5 * (a - x + std::sqrt(x * x + 2 * x * (2 * b - a) + a * a));
    return fraction * dalla_valle(s, reynolds / ratio) / ratio;
  }
};

}  // namespace bedflow
