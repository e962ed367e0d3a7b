// The gas on the staggered grid, by SIMPLE (simple.cpp) or by projection (projection.cpp).
//
//   ∂ε/∂t + ∇·(ε U) = 0
//   ρg ε DU/Dt = −ε_b ∇p + ∇·σ + Σ b (V − U)/cell + ρg ε_b g,     σ = μ(∇U + ∇Uᵀ) − (2/3) μ (∇·U) I
//
// backward Euler. Along driven periodic directions ∇p is that of p less a constant fall. ε_b is the gas share of a face's cell as
// the particles' buoyancy leaves it (Exchange).
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/phase_timer.h"
#include "gas/conjugate_gradients.h"
#include "grid/grid.h"
#include "grid/halo.h"
#include "models/boundary.h"
#include "models/convection.h"

namespace bedflow {

enum class GasMethod { simple, projection };

struct GasSetup {
  GasMethod method = GasMethod::simple;
  double density = 0;                              // ρg, kg/m³
  double viscosity = 0;                            // μ, Pa·s
  Vec3 gravity;                                    // m/s²
  std::array<std::array<Boundary, 2>, 3> faces{};  // [direction][low, high]; ignored where periodic
  std::array<Drive, 3> drive{};                    // along periodic directions
  std::vector<Panel> panels{};
  Convection convection{};           // the grid needs ghosts_of(convection) layers
  double pressure_relaxation = 0.8;  // of SIMPLE, like the next three
  double velocity_relaxation = 0.5;
  int min_iterations = 2;
  int max_iterations = 500;
  double tolerance = 1e-3;           // of the normalised residuals, and what a projection's momentum solve leaves
  double pressure_tolerance = 1e-2;  // reduction in a linear solve of the pressure
  Preconditioner preconditioner = Preconditioner::multigrid;  // of those solves
};

struct GasState {
  FaceField velocity;   // U, m/s, at faces (index: the cell's lower face)
  Field pressure;       // p, Pa, at centres
  Field fraction;       // ε, at centres, ghosts filled; 1 without particles
  Field fraction_rate;  // ∂ε/∂t, 1/s, at centres; 0 without particles or with the displacement switched off

  std::optional<FaceField> jump;  // with panels in the scene: pressure that they take, Pa; no particle feels it as ∇p
  Vec3 fall;                      // of pressure per length along periodic directions, beside that of p, Pa/m

  explicit GasState(const Grid& grid) : velocity(grid), pressure(grid), fraction(grid, 1), fraction_rate(grid) {}
};

// What the particles do to the gas, at faces.
struct Exchange {
  FaceField drag;           // Σ b w, kg/s
  FaceField drag_momentum;  // Σ b V_d w, N
  FaceField buoyancy;       // share of the face's cell in which −∇p acts on particles instead of gas: ε_b = 1 − buoyancy

  explicit Exchange(const Grid& grid) : drag(grid), drag_momentum(grid), buoyancy(grid) {}
};

struct GasOutcome {
  bool converged = false;
  int iterations = 0;
  double momentum_residual = 0, continuity_residual = 0;
  int pressure_iterations = 0;  // of the Krylov solver, all outer iterations together
  std::string reason;           // why it did not converge, for people
};

// Rates of the last step, summed over all ranks: what enters and leaves the box (m³/s of gas) and what is stored (∂ε/∂t).
struct GasBalance {
  double in = 0, out = 0, storage = 0;
};

struct GasStep;  // gas_step.h

class GasSolver {
 public:
  GasSolver(const Decomposition& decomposition, const Grid& grid, Halo& halo, const GasSetup& setup, PhaseTimer& timer);
  ~GasSolver();

  // Fills boundary faces and ghosts for the state at time 0 (s).
  void prepare(GasState& state, double time);

  // One step from time to time + dt. exchange may be null: no particles. Boundary conditions at time + dt.
  // Not converged: the state is as it was before the call. Collective; every rank gets the same outcome.
  GasOutcome advance(GasState& state, const Exchange* exchange, double time, double dt);

  GasBalance balance() const;

  // The faces of component d that carry a momentum equation, as a range of local indices along d; a particle's share on any other
  // face is folded onto the nearest of them. low > high where there is none (one cell between walls).
  struct Range {
    int low, high;  // inclusive
  };
  Range solved_faces(int d) const;

 private:
  std::unique_ptr<GasStep> step_;
};

}  // namespace bedflow
