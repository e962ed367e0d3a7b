#include "plan.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "base/short_number.h"
#include "coupling/transfer.h"
#include "plan_cost.h"
#include "plan_walls.h"

namespace bedflow {

namespace {

constexpr double widest_skin =
    0.8;  // of a cell: half of it a particle may be outside its block, where the halo must know the gas

// The largest superficial velocity that any inflow or held flux of the scene reaches, m/s.
double fastest_inflow(const GasScene& gas) {
  double fastest = 0;
  for (const auto& pair : gas.setup.faces)
    for (const Boundary& face : pair)
      if (const Inflow* inflow = inflow_of(face)) {
        fastest = std::max({fastest, inflow->jet.velocity, inflow->jet.from});
        for (const Inflow::Patch& patch : inflow->patches) fastest = std::max({fastest, patch.jet.velocity, patch.jet.from});
      }
  for (const Drive& drive : gas.setup.drive)
    if (drive.mass_flux) fastest = std::max(fastest, std::abs(*drive.mass_flux) / gas.setup.density);
  return fastest;
}

// 2m/b, the time over which a frozen b (U − V) makes V overshoot U, of the particle that follows the gas the fastest. b is taken
// at the floor of ε and at the slip of the fastest inflow through it.
double drag_limit(const Scene& scene) {
  const double fraction = scene.coupling->fraction_floor;
  const double slip = fastest_inflow(*scene.gas) / fraction;
  double limit = 0;
  for (const SeedKind& kind : scene.particles->kinds) {
    const double d = kind.sizes.smallest() / scene.particles->coarse_graining, mass = kind.density * sphere_volume(d);
    const DragScene drag{scene.gas->setup.density, scene.gas->setup.viscosity, d};
    const double b = std::visit([&](const auto& law) { return law(drag, slip, fraction); }, scene.coupling->drag);
    if (b > 0) limit = limit > 0 ? std::min(limit, 2 * mass / b) : 2 * mass / b;
  }
  return limit;
}

void plan_time(Plan& plan) {
  const Scene& scene = plan.scene;
  const double tau = scene.particles ? scene.particles->collision_time : 0;
  plan.step = scene.substeps ? *scene.substeps * tau / scene.particles->steps_per_collision : scene.step.value_or(tau);
  plan.longest_step = std::max(plan.step, scene.longest_step.value_or(plan.step));
  if (scene.particles) {
    plan.substep = std::min(plan.step, tau / scene.particles->steps_per_collision);
    plan.substeps = static_cast<int>(std::ceil(plan.step / plan.substep - 1e-9));
  }
  plan.shortest_step = scene.shortest_step.value_or(plan.step / 1000);
  plan.steps = static_cast<std::int64_t>(std::ceil(scene.end_time / plan.step - 1e-9));
  if (plan.shortest_step > plan.step) {
    throw Stop(Reason::invalid_case, "time.shortest_step = " + short_number(plan.shortest_step) +
                                         " s is longer than the gas step of " + short_number(plan.step) +
                                         " s (time.step, or the collision time)");
  }
}

// Where what runs in time has its corners.
void plan_corners(Plan& plan) {
  const Scene& scene = plan.scene;
  std::vector<double>& corners = plan.corners;
  const auto add_schedule = [&](const Schedule& schedule) {
    for (const Schedule::Instant& instant : schedule.instants) corners.push_back(instant.time);
  };
  const auto add = [&](const Inflow::Jet& jet) {
    corners.push_back(jet.ramp);
    add_schedule(jet.schedule);
  };
  if (scene.gas) {
    for (const auto& pair : scene.gas->setup.faces)
      for (const Boundary& face : pair)
        if (const Inflow* inflow = inflow_of(face)) {
          add(inflow->jet);
          for (const Inflow::Patch& patch : inflow->patches) add(patch.jet);
        }
    for (const Drive& drive : scene.gas->setup.drive) add_schedule(drive.schedule);
  }
  std::erase_if(corners, [&](double time) { return time <= 0 || time >= scene.end_time; });
  corners.push_back(scene.end_time);
  std::sort(corners.begin(), corners.end());
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
}

void plan_seeds(Plan& plan) {
  const ParticleScene& particles = *plan.scene.particles;
  const auto [low, high] = seed_extent(particles.regions);
  for (const SeedRegion& region : particles.regions) plan.particle_count += expected_count(particles.kinds, region);
  for (const Inlet& inlet : particles.inlets) plan.entering += expected_count(particles.kinds, inlet, plan.scene.end_time);
  for (int d = 0; d < 3; ++d) {
    const double g = plan.scene.gravity[d], way = g < 0 ? high[d] : plan.scene.size[d] - low[d];
    if (std::abs(g) > 0.5 * norm(plan.scene.gravity)) plan.fall_time = std::max(plan.fall_time, std::sqrt(2 * way / std::abs(g)));
  }
}

void plan_space(Plan& plan) {
  const Scene& scene = plan.scene;
  bool shared = plan.ranks > 1;
  for (int d = 0; d < 3; ++d) shared = shared || scene.periodic[d];
  for (int d = 0; d < 3; ++d)
    if (scene.particles && std::abs(scene.gravity[d]) > 0.5 * norm(scene.gravity)) plan.tall = d;
  plan.cells = scene.cells;
  if (scene.gas) plan.ghosts = ghosts_of(scene.gas->setup.convection);
  if (scene.particles) {
    plan.tuned_skin = scene.particles->skin == 0;
    plan.skin = plan.tuned_skin ? 0.25 * scene.particles->largest() : scene.particles->skin;
    if (scene.coupling) {
      const Vec3 spacing{scene.size.x / scene.cells[0], scene.size.y / scene.cells[1], scene.size.z / scene.cells[2]};
      if (plan.tuned_skin) plan.skin = std::min(plan.skin, widest_skin * std::min({spacing.x, spacing.y, spacing.z}));
      plan.ghosts =
          std::max(plan.ghosts, kernel_ghosts(scene.coupling->kernel, scene.particles->largest(), spacing, plan.skin, shared));
    }
    const double reach = scene.particles->largest() + scene.particles->laws.range() + plan.skin;
    for (int d = 0; d < 3; ++d) {
      if (!scene.gas) plan.cells[d] = std::max(1, static_cast<int>(2 * scene.size[d] / scene.particles->largest()));
      const double cell = scene.size[d] / plan.cells[d];
      if (plan.ranks > 1) plan.narrowest[d] = std::max(plan.ghosts, static_cast<int>(std::ceil(reach / cell)));
      if (scene.periodic[d] && scene.size[d] < 2 * reach) {
        throw Stop(Reason::invalid_case,
                   "domain.size: " + short_number(scene.size[d]) + " m in a periodic direction is less than twice the " +
                       "reach of the particles (largest diameter + attraction + skin = " + short_number(reach) + " m)");
      }
      if (scene.gas && plan.skin > widest_skin * cell) {
        throw Stop(Reason::invalid_case, "particles.skin = " + short_number(plan.skin) + " m is too wide for cells of " +
                                             short_number(cell) + " m (domain.cells): at most 0.8 of a cell");
      }
    }
  } else if (plan.ranks > 1) {
    plan.narrowest = {plan.ghosts, plan.ghosts, plan.ghosts};
  }
  plan.cell_count = scene.gas ? static_cast<std::int64_t>(scene.cells[0]) * scene.cells[1] * scene.cells[2] : 0;
  if (scene.particles) plan_seeds(plan);
}

void plan_pressure(Plan& plan) {
  if (!plan.scene.gas) return;
  plan.scene.gas->setup.preconditioner = plan.scene.gas->preconditioner.value_or(Preconditioner::multigrid);
}

void check_memory(Plan& plan) {
  const double here = static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGE_SIZE));
  if (plan.memory_bytes > here) {
    plan.warnings.push_back("the scene needs about " + short_number(plan.memory_bytes / 1e9) + " GB, this machine has " +
                            short_number(here / 1e9) + " GB: fewer cells (domain.cells) or particles, or a machine with more");
  }
}

std::string kernel_text(const Scene& scene) {
  const std::string name = std::visit([](const auto& kernel) { return std::string(kernel.name); }, scene.coupling->kernel);
  if (const auto* dpvm = std::get_if<SquareDpvm>(&scene.coupling->kernel)) {
    return name + ", " + short_number(dpvm->width) + " d wide" + (dpvm->caps ? ", shared by caps" : "");
  }
  if (const auto* gaussian = std::get_if<Gaussian>(&scene.coupling->kernel)) {
    return name + ", " + short_number(gaussian->width) + " d wide at half maximum";
  }
  return name + ", as wide as the cells";
}

std::string sizes_text(const ParticleScene& particles) {
  double smallest = particles.largest();
  for (const SeedKind& kind : particles.kinds) smallest = std::min(smallest, kind.sizes.smallest());
  return (smallest < particles.largest() ? short_number(smallest) + " to " : "") + short_number(particles.largest()) + " m";
}

std::string parcels_text(const ParticleScene& particles) {
  const double l = particles.coarse_graining;
  if (l == 1) return "each particle by itself";
  return "each stands for " + short_number(l * l * l) + " of d = " + short_number(particles.largest() / l) +
         " m, which feel the gas";
}

void add_sizes(Plan& plan) {
  const ParticleScene& particles = *plan.scene.particles;
  const auto add = [&](const char* part, bool on, const std::string& why) { plan.items.push_back({part, on, why}); };
  add("parcels of particles", particles.coarse_graining > 1, parcels_text(particles));
  const auto types = particles.kinds.size();
  const bool distributed =
      std::any_of(particles.types.begin(), particles.types.end(), [](const ParticleType& type) { return type.distributed; });
  add("several types", types > 1, types > 1 ? std::to_string(types) + " in particles.types" : "all are of one");
  add("radius per particle", distributed, distributed ? "a type has more than one size" : "a type has one size");
  add("particles that enter", !particles.inlets.empty(),
      particles.inlets.empty() ? "no particle_inflows on any face" : "about " + std::to_string(plan.entering) + " until the end");
  const bool outlet = std::any_of(plan.scene.sides.begin(), plan.scene.sides.end(),
                                  [](const auto& pair) { return pair[0] == Side::outlet || pair[1] == Side::outlet; });
  add("particles that leave", outlet, outlet ? "through outflow { particles: LEAVE }" : "one that leaves stops the run");
}

void plan_parts(Plan& plan) {
  const Scene& scene = plan.scene;
  const auto add = [&](const char* part, bool on, const std::string& why) { plan.items.push_back({part, on, why}); };
  add(!scene.gas || scene.gas->setup.method == GasMethod::simple ? "gas grid and SIMPLE" : "gas grid and projection",
      scene.gas.has_value(),
      scene.gas ? std::to_string(scene.cells[0]) + " x " + std::to_string(scene.cells[1]) + " x " +
                      std::to_string(scene.cells[2]) + " cells"
                : "the case has no gas");
  if (scene.gas) {
    const Preconditioner preconditioner = scene.gas->setup.preconditioner;
    add("multigrid for the pressure", preconditioner == Preconditioner::multigrid,
        std::string("gas.") + name(preconditioner) +
            (scene.gas->preconditioner ? ": the case says so" : ": its iterations do not grow with the grid"));
    const auto& scheme = scene.gas->setup.convection;
    const bool second = !std::holds_alternative<Upwind>(scheme);
    add("convection of second order", second,
        std::string("gas.") + std::visit([](const auto& law) { return law.name; }, scheme) +
            (second ? ": two layers of ghosts" : ": first order"));
  }
  add("particles and contacts", scene.particles.has_value(),
      scene.particles ? std::to_string(plan.particle_count) + " of d = " + sizes_text(*scene.particles)
                      : "the case has no particles");
  if (scene.particles) {
    const bool rotation = scene.particles->laws.rotation(), history = scene.particles->laws.history();
    add("rotation", rotation, rotation ? "the tangential law turns the particles" : "without friction nothing turns them");
    add("contact history", history, history ? "the tangential spring remembers" : "the tangential law has no memory");
    const ContactLaws& laws = scene.particles->laws;
    add("rolling resistance", laws.rolls(), laws.rolls() ? "the case names a rolling law" : "the case names none");
    const double range = laws.range();
    add("attraction", range > 0, range > 0 ? "over gaps up to " + short_number(range) + " m" : "the case names none");
    add("velocity Verlet", scene.particles->verlet,
        scene.particles->verlet ? "the case says so" : "symplectic Euler, first order in dt, one force a sub-step");
    add_sizes(plan);
    add("walls within the box", !scene.walls.empty(), scene.walls.empty() ? "the case has none" : walls_text(scene.walls));
    const bool settling = scene.particles->settling.has_value();
    add("settling before time 0", settling, settling ? "asked for by the seeding" : "not asked for");
  }
  add("coupling", scene.coupling.has_value(),
      scene.coupling ? "gas and particles are both there" : "there is only one of the two");
  if (scene.coupling) {
    add("drag law", true, std::visit([](const auto& law) { return std::string(law.name); }, scene.coupling->drag));
    add("kernel", true, kernel_text(scene));
    add("exchange", true, std::visit([](const auto& scheme) { return std::string(scheme.name); }, scene.coupling->scheme));
    add("displacement of gas, ∂ε/∂t", scene.coupling->displacement,
        scene.coupling->displacement
            ? "default"
            : "coupling.displacement is off: moving particles do not displace gas, as in the paper's code");
    if (!scene.coupling->displacement)
      plan.warnings.push_back("coupling.displacement is off: ∂ε/∂t is left out of the gas balance, which is wrong on purpose");
  }
  if (scene.gas) {
    const auto& setup = scene.gas->setup;
    const bool driven = std::any_of(setup.drive.begin(), setup.drive.end(),
                                    [](const Drive& drive) { return drive.pressure_drop || drive.mass_flux; });
    add("driven periodic flow", driven, driven ? "gas.driving" : "not asked for");
    add("panels in the box", !setup.panels.empty(), std::to_string(setup.panels.size()) + " in the case");
    const bool limited = plan.longest_step > plan.step || scene.courant;
    add("adaptive step", limited,
        limited ? "up to " + short_number(plan.longest_step) + " s" +
                      (scene.courant ? ", Courant number at most " + short_number(*scene.courant) : "")
                : "cut by convergence only: neither time.longest_step nor time.courant is set");
  }
  add("messages between ranks", plan.ranks > 1, plan.ranks > 1 ? std::to_string(plan.ranks) + " ranks" : "one rank");
  add("monitors", !scene.monitors.empty(), std::to_string(scene.monitors.size()) + " in the case");
  add("plot files", scene.plot_interval.has_value(),
      scene.plot_interval ? "every " + short_number(*scene.plot_interval) + " s" : "not asked for");
}

void check_coupling(Plan& plan) {
  const Scene& scene = plan.scene;
  if (!scene.coupling) return;
  plan.cell_ratio =
      std::cbrt(scene.size.x * scene.size.y * scene.size.z / static_cast<double>(plan.cell_count)) / scene.particles->largest();
  plan.drag_limit = drag_limit(scene);
  const auto [name, limited] =
      std::visit([&](const auto& scheme) { return std::pair(std::string(scheme.name), scheme.limited(plan.step, plan.substep)); },
                 scene.coupling->scheme);
  if (plan.drag_limit > 0 && limited > plan.drag_limit) {
    const bool frozen = std::holds_alternative<Explicit>(scene.coupling->scheme);
    throw Stop(Reason::invalid_case, "coupling." + name + " is unstable beyond 2m/b = " + short_number(plan.drag_limit) +
                                         " s (mass of a particle over the heaviest drag in sight), the " +
                                         (frozen ? "gas step" : "sub-step") + " is " + short_number(limited) +
                                         " s; choose coupling.semi_implicit, or " +
                                         (frozen ? "set time.step below that" : "more particles.steps_per_collision"));
  }
  if (plan.cell_ratio < 1.5 || plan.cell_ratio > 5) {
    plan.warnings.push_back("cells of Δ* = " + short_number(plan.cell_ratio) + " diameters: about 2 is the field's rule");
  }
}

}  // namespace

Plan make_plan(const Scene& scene, int ranks) {
  Plan plan;
  plan.scene = scene;
  plan.ranks = ranks;
  plan_space(plan);
  plan_time(plan);
  plan_corners(plan);
  check_coupling(plan);
  plan_pressure(plan);
  if (scene.particles) check_walls(scene, plan.skin, plan.substep);
  plan_cost(plan);
  check_memory(plan);
  plan_parts(plan);
  for (const MonitorSetup& monitor : scene.monitors) {
    const double needed = monitor.averaging_start + monitor.averaging_bin * monitor.averaging_bins;
    if (monitor.averaging_bin > 0 && needed > scene.end_time * (1 + 1e-9)) {
      plan.warnings.push_back("monitor " + monitor.name + " asks for " + std::to_string(monitor.averaging_bins) + " bins until " +
                              short_number(needed) + " s, the run ends at " + short_number(scene.end_time) + " s");
    }
  }
  return plan;
}

std::string Plan::text() const {
  std::ostringstream out;
  const auto line = [&](const std::string& name, const std::string& value) {
    out << "  " << name << std::string(name.size() < 26 ? 26 - name.size() : 1, ' ') << value << "\n";
  };
  out << "plan of " << scene.name << " on " << ranks << (ranks == 1 ? " rank\n" : " ranks\n");
  for (const PlanItem& item : items) {
    // Names hold letters of more than one byte: pad by what is seen.
    const auto seen = static_cast<std::size_t>(
        std::count_if(item.part.begin(), item.part.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
    out << (item.on ? "  on   " : "  off  ") << item.part << std::string(seen < 29 ? 29 - seen : 1, ' ') << item.why << "\n";
  }
  if (scene.particles) {
    line("collision time tau", short_number(scene.particles->collision_time) + " s");
    line("sub-step dt_DEM", short_number(substep) + " s, " + std::to_string(substeps) + " a step");
    line("skin of the pair list", short_number(skin) + (tuned_skin ? " m at the start, then tuned" : " m"));
    for (const SeedKind& kind : scene.particles->kinds) {
      if (kind.sizes.constant()) continue;
      line("sizes of " + kind.name, short_number(kind.sizes.smallest()) + " to " + short_number(kind.sizes.largest()) +
                                        " m, mean " + short_number(kind.sizes.mean()) + " m, d32 " +
                                        short_number(kind.sizes.sauter()) + " m");
    }
  }
  line(scene.gas ? "gas step dt_CFD" : "step", short_number(step) + " s, not below " + short_number(shortest_step) + " s");
  if (corners.size() > 1) line("instants that steps end on", std::to_string(corners.size() - 1) + " before the end");
  if (cell_ratio > 0) line("cell over particle size", short_number(cell_ratio) + " (Δ*)");
  if (drag_limit > 0)
    line("2m/b of the heaviest drag", short_number(drag_limit) + " s, " + short_number(drag_limit / step) + " times the step");
  line("steps", std::to_string(steps) + " to " + short_number(scene.end_time) + " s");
  line("cells", std::to_string(cell_count));
  line("particles", std::to_string(particle_count));
  line("memory", short_number(memory_bytes / 1e6) + " MB");
  line("checkpoint", short_number(checkpoint_bytes / 1e6) + " MB");
  line("estimated wall time", short_number(seconds) + " s");
  if (!scene.fidelity.empty()) line("fidelity", scene.fidelity);
  for (const std::string& warning : warnings) out << "  warning: " << warning << "\n";
  return out.str();
}

}  // namespace bedflow
