#include "case/case_scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "case/contact_scene.h"
#include "case/seeding_scene.h"
#include "case/vector.h"
#include "case/wall_scene.h"
#include "case_file.h"
#include "coarse_graining.h"
#include "fidelity.h"

namespace bedflow {

namespace {

// ---- gas

Schedule schedule(const google::protobuf::RepeatedPtrField<v1::Instant>& from) {
  Schedule result;
  for (const v1::Instant& instant : from) result.instants.push_back({instant.time(), instant.share()});
  return result;
}

// Of v1::Inflow or v1::Patch.
template <class From>
Inflow::Jet jet(const From& from) {
  if (from.has_ramp()) return {from.velocity(), from.ramp().from(), from.ramp().duration()};
  return {from.velocity(), from.velocity(), 0, schedule(from.schedule())};
}

MassInflow mass_inflow(const v1::MassInflow& from, double density, const v1::Lengths& size, int axis) {
  const Vec3 edges{size.x(), size.y(), size.z()};
  const bool part = from.has_rectangle();
  const Vec3 low = part ? vec(from.rectangle().low()) : Vec3{}, high = part ? vec(from.rectangle().high()) : edges;
  const int one = (axis + 1) % 3, other = (axis + 2) % 3;
  const double area = (high[one] - low[one]) * (high[other] - low[other]);
  const Schedule course = schedule(from.schedule());
  return part ? MassInflow(from.mass_flow(), density, area, course, low, high)
              : MassInflow(from.mass_flow(), density, area, course);
}

Boundary boundary(const v1::Face& face, const v1::Case& scene, int axis) {
  switch (face.condition_case()) {
    case v1::Face::kFreeSlipWall:
      return FreeSlip{};
    case v1::Face::kOutflow:
      return Outflow{face.outflow().pressure()};
    case v1::Face::kInflow: {
      Inflow inflow{jet(face.inflow()), {}};
      for (const v1::Patch& patch : face.inflow().patches()) {
        inflow.patches.push_back({vec(patch.low()), vec(patch.high()), jet(patch)});
      }
      return inflow;
    }
    case v1::Face::kMassInflow:
      return mass_inflow(face.mass_inflow(), scene.gas().density(), scene.domain().size(), axis);
    default:
      return NoSlip{vec(face.no_slip_wall().velocity())};
  }
}

using SixFaces = std::array<std::array<const v1::Face*, 2>, 3>;
SixFaces six_faces(const v1::Faces& f) {
  return {{{&f.x_low(), &f.x_high()}, {&f.y_low(), &f.y_high()}, {&f.z_low(), &f.z_high()}}};
}

Convection convection(const v1::Gas& from) {
  switch (from.convection_case()) {
    case v1::Gas::kSmart:
      return Smart{};
    case v1::Gas::kSuperbee:
      return Superbee{};
    default:
      return Upwind{};
  }
}

Drive drive(const v1::Drive& from) {
  Drive result{.pressure_drop = {}, .mass_flux = {}, .schedule = schedule(from.schedule())};
  if (from.has_pressure_drop()) result.pressure_drop = from.pressure_drop();
  if (from.has_mass_flux()) result.mass_flux = from.mass_flux();
  return result;
}

Panel panel_of(const v1::Panel& from) {
  Panel panel{vec(from.low()), vec(from.high()), Baffle{}};
  if (from.has_plate()) panel.kind = Plate{from.plate().linear(), from.plate().quadratic()};
  return panel;
}

std::optional<Preconditioner> preconditioner(const v1::Gas& from) {
  switch (from.pressure_solver_case()) {
    case v1::Gas::kMultigrid:
      return Preconditioner::multigrid;
    case v1::Gas::kIncompleteCholesky:
      return Preconditioner::incomplete_cholesky;
    case v1::Gas::kUnpreconditioned:
      return Preconditioner::unpreconditioned;
    default:
      return std::nullopt;
  }
}

GasScene gas_scene(const v1::Case& from) {
  const v1::Gas& gas = from.gas();
  const v1::Simple& simple = gas.simple();
  GasScene scene;
  scene.initial_velocity = vec(gas.initial_velocity());
  scene.preconditioner = preconditioner(gas);
  scene.setup = {.density = gas.density(),
                 .viscosity = gas.viscosity(),
                 .gravity = vec(from.gravity()),
                 .faces = {},
                 .convection = convection(gas),
                 .pressure_relaxation = simple.pressure_relaxation(),
                 .velocity_relaxation = simple.velocity_relaxation(),
                 .min_iterations = static_cast<int>(simple.min_iterations()),
                 .max_iterations = static_cast<int>(simple.max_iterations()),
                 .tolerance = simple.tolerance(),
                 .pressure_tolerance = simple.pressure_tolerance()};
  if (gas.has_projection()) {
    scene.setup.method = GasMethod::projection;
    scene.setup.tolerance = gas.projection().momentum_tolerance();
    scene.setup.pressure_tolerance = gas.projection().pressure_tolerance();
  }
  const SixFaces faces = six_faces(from.domain().faces());
  for (int d = 0; d < 3; ++d)
    for (int side = 0; side < 2; ++side) scene.setup.faces[d][side] = boundary(*faces[d][side], from, d);
  scene.setup.drive = {drive(gas.driving().x()), drive(gas.driving().y()), drive(gas.driving().z())};
  for (const v1::Panel& panel : from.domain().panels()) scene.setup.panels.push_back(panel_of(panel));
  return scene;
}

// ---- particles

ParticleScene particle_scene(const v1::Case& from) {
  const v1::Particles& particles = from.particles();
  ParticleScene scene;
  scene.kinds = seed_kinds(particles);
  scene.regions = seed_regions(from, scene.kinds);
  scene.inlets = particle_inlets(from, scene.kinds);
  std::vector<ContactType> types;
  for (const SeedKind& kind : scene.kinds) {
    types.push_back({kind.name, {kind.sizes.largest() / 2, kind.density, !kind.sizes.constant()}, kind.sizes.smallest() / 2});
    scene.types.push_back(types.back().type);
  }
  scene.laws = contact_laws(from, types);
  if (const v1::Settling* settling = settling_of(particles)) {
    scene.settling =
        Settling{settling->duration(), settling->rest_velocity(), contact_law_with(from, types, settling->restitution())};
  }
  scene.collision_time = collision_time(from, scene.laws.contact, types);
  scene.steps_per_collision = particles.steps_per_collision();
  scene.skin = particles.skin();
  scene.verlet = particles.has_velocity_verlet();
  if (particles.has_coarse_graining()) scene.coarse_graining = particles.coarse_graining().factor();
  return scene;
}

// ---- coupling, monitors

Drag drag(const v1::Coupling& from) {
  switch (from.drag_case()) {
    case v1::Coupling::kGidaspow:
      return Gidaspow{};
    case v1::Coupling::kWenYu:
      return WenYu{};
    case v1::Coupling::kErgun:
      return Ergun{};
    case v1::Coupling::kSchillerNaumann:
      return SchillerNaumann{};
    case v1::Coupling::kDiFelice:
      return DiFelice{};
    case v1::Coupling::kSyamlalObrien:
      return SyamlalObrien{};
    case v1::Coupling::kKochHill:
      return KochHill{};
    case v1::Coupling::kBeetstra:
      return Beetstra{};
    case v1::Coupling::kTenneti:
      return Tenneti{};
    case v1::Coupling::kConstantDrag:
      return ConstantDrag{from.constant_drag().coefficient()};
    default:
      return GidaspowBlended{};
  }
}

Kernel kernel(const v1::Coupling& from) {
  switch (from.kernel_case()) {
    case v1::Coupling::kSquareDpvm:
      return SquareDpvm{from.square_dpvm().width(), from.square_dpvm().caps()};
    case v1::Coupling::kGarg:
      return Garg{};
    case v1::Coupling::kGaussian:
      return Gaussian{{}, from.gaussian().width()};
    default:
      return Hat{};
  }
}

CouplingScene coupling_scene(const v1::Coupling& from) {
  CouplingScene scene;
  scene.drag = drag(from);
  scene.kernel = kernel(from);
  if (from.has_sub_stepped()) scene.scheme = SubStepped{};
  if (from.has_semi_implicit()) scene.scheme = SemiImplicit{};
  scene.displacement = from.displacement();
  scene.fraction_floor = from.gas_fraction_floor();
  return scene;
}

// Place among the faces of the box and then the walls.
int wall_index(const v1::Case& from, const std::string& name) {
  constexpr std::array faces{"x_low", "x_high", "y_low", "y_high", "z_low", "z_high"};
  const auto face = std::find(faces.begin(), faces.end(), name);
  if (face != faces.end()) return static_cast<int>(face - faces.begin());
  const auto wall = std::find_if(from.walls().begin(), from.walls().end(), [&](const v1::Wall& w) { return w.name() == name; });
  return static_cast<int>(faces.size() + static_cast<std::size_t>(wall - from.walls().begin()));
}

Statistic statistic(const v1::Case& scene, const v1::Monitor& from) {
  const v1::Particles& particles = scene.particles();
  constexpr double everywhere = std::numeric_limits<double>::infinity();
  switch (from.quantity_case()) {
    case v1::Monitor::kBedHeight:
      return BedHeight{from.bed_height().above(), from.bed_height().has_depth() ? from.bed_height().depth() : everywhere};
    case v1::Monitor::kPressureDrop:
      return PressureDrop{from.pressure_drop().low(), from.pressure_drop().high()};
    case v1::Monitor::kMassBalance:
      return MassBalance{};
    case v1::Monitor::kMomentumBalance:
      return MomentumBalance{};
    case v1::Monitor::kMaxOverlap:
      return MaxOverlap{};
    case v1::Monitor::kParticleCount:
      return ParticleCount{type_index(particles, from.particle_count().type()),
                           particles.has_coarse_graining() ? std::pow(particles.coarse_graining().factor(), 3) : 1};
    case v1::Monitor::kParticleMass:
      return ParticleMass{type_index(particles, from.particle_mass().type())};
    case v1::Monitor::kMassEntered:
      return MassEntered{};
    case v1::Monitor::kMassLeft:
      return MassLeft{};
    case v1::Monitor::kVoidFraction:
      return VoidFractionProfile{from.void_fraction().height()};
    case v1::Monitor::kParticleVelocity: {
      const v1::VelocityProfile& profile = from.particle_velocity();
      return VelocityProfile{profile.height(),
                             profile.half_height(),
                             static_cast<int>(profile.bins()),
                             static_cast<int>(profile.component()),
                             profile.depth_low(),
                             profile.has_depth_high() ? profile.depth_high() : everywhere};
    }
    case v1::Monitor::kParticleMomentum:
      return ParticleMomentum{static_cast<int>(from.particle_momentum().axis())};
    case v1::Monitor::kWallForce:
      return WallForce{wall_index(scene, from.wall_force().wall()), static_cast<int>(from.wall_force().axis())};
    case v1::Monitor::kWallTorque:
      return WallTorque{wall_index(scene, from.wall_torque().wall()), static_cast<int>(from.wall_torque().axis())};
    default:
      return KineticEnergy{};
  }
}

Side side(const v1::Face& face) {
  if (face.outflow().particles() == v1::LEAVE) return Side::outlet;
  return face.has_outflow() && !face.outflow().screen() ? Side::open : Side::wall;
}

Scene make_scene(const v1::Case& from) {
  Scene scene;
  scene.name = from.name();
  scene.size = {from.domain().size().x(), from.domain().size().y(), from.domain().size().z()};
  if (from.has_gas()) {
    const v1::Cells& cells = from.domain().cells();
    scene.cells = {static_cast<int>(cells.x()), static_cast<int>(cells.y()), static_cast<int>(cells.z())};
    scene.gas = gas_scene(from);
  }
  scene.periodic = {from.domain().periodic().x(), from.domain().periodic().y(), from.domain().periodic().z()};
  const SixFaces faces = six_faces(from.domain().faces());
  for (int d = 0; d < 3; ++d)
    for (int s = 0; s < 2; ++s) scene.sides[d][s] = scene.periodic[d] ? Side::periodic : side(*faces[d][s]);
  scene.gravity = vec(from.gravity());
  if (from.has_particles()) scene.particles = particle_scene(from);
  scene.walls = wall_scene(from);
  if (from.has_coupling()) scene.coupling = coupling_scene(from.coupling());
  scene.end_time = from.time().end();
  if (from.time().has_step()) scene.step = from.time().step();
  if (from.time().has_substeps()) scene.substeps = static_cast<int>(from.time().substeps());
  if (from.time().has_longest_step()) scene.longest_step = from.time().longest_step();
  if (from.time().has_courant()) scene.courant = from.time().courant();
  if (from.time().has_shortest_step()) scene.shortest_step = from.time().shortest_step();
  for (const v1::Monitor& monitor : from.monitors()) {
    MonitorSetup setup{monitor.name(), statistic(from, monitor), monitor.interval()};
    if (monitor.has_averaging()) {
      setup.averaging_start = monitor.averaging().start();
      setup.averaging_bin = monitor.averaging().bin();
      setup.averaging_bins = static_cast<int>(monitor.averaging().bins());
    }
    scene.monitors.push_back(std::move(setup));
  }
  const v1::Guard& guard = from.guard();
  scene.guard = {guard.overlap(), guard.move(),   guard.gas_fraction(),
                 guard.courant(), guard.energy(), static_cast<int>(guard.retries())};
  if (from.output().has_interval()) scene.plot_interval = from.output().interval();
  return scene;
}

}  // namespace

namespace {

Scene checked_scene(const CaseRead& read, const std::string& where) {
  if (!read.faults.empty()) {
    std::string all = std::to_string(read.faults.size()) + (read.faults.size() == 1 ? " fault" : " faults") + " in " + where;
    for (const CaseFault& fault : read.faults) all += "\n  " + fault.path + ": " + fault.text;
    throw Stop(Reason::invalid_case, all);
  }
  Scene scene = make_scene(parcels_of(read.value));
  scene.fidelity = standing_text(read.value);
  return scene;
}

}  // namespace

Scene read_scene(const std::filesystem::path& case_file) {
  return checked_scene(read_case_file(case_file), case_file.string());
}

Scene scene_of(const std::string& case_text) {
  return checked_scene(read_case(case_text), "the case");
}

}  // namespace bedflow
