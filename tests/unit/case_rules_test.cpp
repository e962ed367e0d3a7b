// The rules that join fields: each speaks for its fault, at its path, and is silent otherwise.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "case_file.h"
#include "cases/ready_cases.h"
#include "support/case_faults.h"

namespace bedflow {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

using Change = std::function<void(v1::Case&)>;

// Faults of a good bed after a change; of a bed without monitors, so that a part can be taken away.
std::vector<CaseFault> after(const Change& change) {
  v1::Case value = ready_case("mueller");
  value.clear_monitors();
  value.clear_references();
  change(value);
  return check_case(value);
}

v1::Face& bottom(v1::Case& c) {
  return *c.mutable_domain()->mutable_faces()->mutable_y_low();
}

void set_vector(v1::Vector* vector, double x, double y, double z) {
  vector->set_x(x);
  vector->set_y(y);
  vector->set_z(z);
}

TEST(CaseRules, AreSilentOnGoodBedsAndOnParts) {
  EXPECT_THAT(after([](v1::Case&) {}), IsEmpty());
  EXPECT_THAT(after([](v1::Case& c) { c.clear_gas(), c.clear_coupling(), c.mutable_domain()->clear_cells(); }), IsEmpty());
  EXPECT_THAT(after([](v1::Case& c) { c.clear_particles(), c.clear_coupling(), c.mutable_time()->set_step(1e-3); }), IsEmpty());
}

TEST(CaseRules, SceneNeedsGasOrParticles) {
  EXPECT_THAT(after([](v1::Case& c) { c.clear_gas(), c.clear_particles(), c.clear_coupling(), c.mutable_time()->set_step(1); }),
              ElementsAre(fault_at("gas", "and so is particles")));
}

TEST(CaseRules, GasAndParticlesNeedACoupling) {
  EXPECT_THAT(after([](v1::Case& c) { c.clear_coupling(); }), ElementsAre(fault_at("coupling", "is missing")));
}

TEST(CaseRules, CouplingNeedsBoth) {
  EXPECT_THAT(after([](v1::Case& c) { c.clear_gas(); }), ElementsAre(fault_at("coupling", "no gas")));
  EXPECT_THAT(after([](v1::Case& c) { c.clear_particles(), c.mutable_time()->set_step(1e-3); }),
              ElementsAre(fault_at("coupling", "no particles")));
}

TEST(CaseRules, GasNeedsCells) {
  EXPECT_THAT(after([](v1::Case& c) { c.mutable_domain()->clear_cells(); }), ElementsAre(fault_at("domain.cells", "gas")));
}

TEST(CaseRules, StepMustBeSaidWithoutParticles) {
  EXPECT_THAT(after([](v1::Case& c) { c.clear_particles(), c.clear_coupling(); }),
              ElementsAre(fault_at("time.step", "without particles")));
}

TEST(CaseRules, ShortestStepIsNotAboveTheStep) {
  EXPECT_THAT(after([](v1::Case& c) { c.mutable_time()->set_step(1e-4), c.mutable_time()->set_shortest_step(2e-4); }),
              ElementsAre(fault_at("time.shortest_step", "time.step")));
  EXPECT_THAT(after([](v1::Case& c) { c.mutable_time()->set_step(1e-4), c.mutable_time()->set_shortest_step(1e-4); }), IsEmpty());
}

TEST(CaseRules, CellsMustHoldAParticleForTheHat) {
  // 0.120 m / 201 < 0.6 mm, half of the diameter; 200 cells are just allowed
  EXPECT_THAT(after([](v1::Case& c) { c.mutable_domain()->mutable_cells()->set_y(201); }),
              ElementsAre(fault_at("domain.cells.y", "use at most 200")));
  EXPECT_THAT(after([](v1::Case& c) { c.mutable_domain()->mutable_cells()->set_y(200); }), IsEmpty());
  EXPECT_THAT(after([](v1::Case& c) {
                c.mutable_domain()->mutable_cells()->set_y(120);
                c.mutable_domain()->mutable_cells()->set_x(50);
                c.mutable_domain()->mutable_cells()->set_z(12);
              }),
              ElementsAre(fault_at("domain.cells", "at least 1")));
  // a Gaussian has its own width; the cube of the DPVM, 1.8 mm, must stay within four cells
  EXPECT_THAT(after([](v1::Case& c) {
                c.mutable_coupling()->mutable_gaussian();
                c.mutable_domain()->mutable_cells()->set_y(400);
              }),
              IsEmpty());
  EXPECT_THAT(after([](v1::Case& c) {
                c.mutable_coupling()->mutable_square_dpvm();
                c.mutable_domain()->mutable_cells()->set_y(200);
              }),
              ElementsAre(fault_at("domain.cells.y", "use at most 196")));
  // a direction that is one cell deep is held to the same limit
  EXPECT_THAT(
      after([](v1::Case& c) {
        c.mutable_domain()->mutable_size()->set_z(0.0005);
        c.mutable_domain()->mutable_cells()->set_z(1);
        c.mutable_particles()->clear_random();
        set_vector(c.mutable_particles()->mutable_placed()->add_spheres()->mutable_position(), 0.01, 0.01, 0);
      }),
      ElementsAre(fault_at("domain.cells.z", "make domain.size.z larger"), fault_at("particles.diameter", "domain.size.z")));
}

TEST(CaseRules, DragLawNeedsViscosity) {
  EXPECT_THAT(after([](v1::Case& c) { c.mutable_gas()->set_viscosity(0); }),
              ElementsAre(fault_at("gas.viscosity", "coupling.drag")));
  EXPECT_THAT(after([](v1::Case& c) {
                c.mutable_gas()->set_viscosity(0);
                c.mutable_coupling()->mutable_constant_drag()->set_coefficient(1e-6);
              }),
              IsEmpty());
}

TEST(CaseRules, PeriodicDirectionHasNoFaces) {
  EXPECT_THAT(after([](v1::Case& c) {
                c.mutable_domain()->mutable_periodic()->set_z(true);
                c.mutable_domain()->mutable_faces()->clear_z_low();
              }),
              ElementsAre(fault_at("domain.faces.z_high", "domain.periodic.z")));
  EXPECT_THAT(after([](v1::Case& c) {
                c.mutable_domain()->mutable_periodic()->set_z(true);
                c.mutable_domain()->mutable_faces()->clear_z_low();
                c.mutable_domain()->mutable_faces()->clear_z_high();
              }),
              IsEmpty());
}

TEST(CaseRules, WallsSlideButDoNotMoveThroughTheirFace) {
  const auto wall = [](v1::Case& c) { return c.mutable_domain()->mutable_faces()->mutable_x_high()->mutable_no_slip_wall(); };
  EXPECT_THAT(after([&](v1::Case& c) { wall(c)->mutable_velocity()->set_x(1); }),
              ElementsAre(fault_at("domain.faces.x_high.no_slip_wall.velocity.x", "is 1 m/s")));
  EXPECT_THAT(after([&](v1::Case& c) { wall(c)->mutable_velocity()->set_y(1); }), IsEmpty());
}

TEST(CaseRules, PatchesLieWithinTheirFace) {
  const auto with_patch = [](double x0, double x1, double z0, double z1) {
    return [=](v1::Case& c) {
      auto* patch = bottom(c).mutable_inflow()->add_patches();
      set_vector(patch->mutable_low(), x0, 0, z0);
      set_vector(patch->mutable_high(), x1, 0, z1);
      patch->set_velocity(1);
    };
  };
  const std::string path = "domain.faces.y_low.inflow.patches[0].high";
  EXPECT_THAT(after(with_patch(0.01, 0.044, 0, 0.01)), IsEmpty());
  EXPECT_THAT(after(with_patch(0.01, 0.045, 0, 0.01)),
              ElementsAre(fault_at(path + ".x", "outside the domain: at most domain.size.x, 0.044")));
  EXPECT_THAT(after(with_patch(0.01, 0.02, 0.01, 0.01)), ElementsAre(fault_at(path + ".z", "not above")));
}

TEST(CaseRules, WhatFlowsInMustFlowOut) {
  EXPECT_THAT(after([](v1::Case& c) { c.mutable_domain()->mutable_faces()->mutable_y_high()->mutable_no_slip_wall(); }),
              ElementsAre(fault_at("domain.faces.y_low.inflow", "set outflow")));
  EXPECT_THAT(after([](v1::Case& c) {
                c.mutable_domain()->mutable_faces()->mutable_y_high()->mutable_no_slip_wall();
                bottom(c).mutable_no_slip_wall();
              }),
              IsEmpty());  // a closed box
}

TEST(CaseRules, ParticlesFitIntoTheDomain) {
  EXPECT_THAT(after([](v1::Case& c) {
                c.mutable_domain()->mutable_size()->set_z(0.001);
                c.clear_gas(), c.clear_coupling();
                c.mutable_particles()->clear_random();
                set_vector(c.mutable_particles()->mutable_placed()->add_spheres()->mutable_position(), 0.01, 0.01, 0);
              }),
              ElementsAre(fault_at("particles.diameter", "domain.size.z")));
}

TEST(CaseRules, SkinIsBelowHalfTheSmallestEdge) {
  EXPECT_THAT(after([](v1::Case& c) { c.mutable_particles()->set_skin(0.005); }),
              ElementsAre(fault_at("particles.skin", "0.005 m")));
  EXPECT_THAT(after([](v1::Case& c) { c.mutable_particles()->set_skin(0.0049); }), IsEmpty());
}

TEST(CaseRules, RegionIsInsideTheDomainAndHoldsAParticle) {
  const std::string path = "particles.random.region.high";
  const auto region = [](v1::Case& c) {
    c.mutable_particles()->mutable_random()->set_count(1);
    return c.mutable_particles()->mutable_random()->mutable_region();
  };
  EXPECT_THAT(after([&](v1::Case& c) { region(c)->mutable_high()->set_y(0.2); }),
              ElementsAre(fault_at(path + ".y", "domain.size.y")));
  EXPECT_THAT(after([&](v1::Case& c) { region(c)->mutable_low()->set_x(0.044); }),
              ElementsAre(fault_at(path + ".x", "not above")));
  EXPECT_THAT(after([&](v1::Case& c) { region(c)->mutable_low()->set_x(0.0435); }),
              ElementsAre(fault_at(path + ".x", "particles.diameter")));
}

TEST(CaseRules, RandomPlacingHasALargestCount) {
  // 0.35 · 44 · 68 · 10 mm³ / (π/6 · 1.2³ mm³) = 11574
  EXPECT_THAT(after([](v1::Case& c) { c.mutable_particles()->mutable_random()->set_count(11575); }),
              ElementsAre(fault_at("particles.random.count", "which is 11574 particles")));
  EXPECT_THAT(after([](v1::Case& c) { c.mutable_particles()->mutable_random()->set_count(11574); }), IsEmpty());
  EXPECT_THAT(after([](v1::Case& c) {
                c.mutable_particles()->mutable_random()->set_count(30000);
                c.mutable_particles()->mutable_random()->clear_region();
              }),
              ElementsAre(fault_at("particles.random.count", "a solids fraction of 0.514")));
}

TEST(CaseRules, SettlingNeedsGravityAndAFloor) {
  EXPECT_THAT(after([](v1::Case& c) { c.mutable_gravity()->clear_y(); }),
              ElementsAre(fault_at("particles.random.settling", "needs gravity")));
  EXPECT_THAT(after([](v1::Case& c) {
                c.mutable_domain()->clear_faces();
                c.mutable_domain()->mutable_periodic()->set_y(true);
              }),
              ElementsAre(fault_at("particles.random.settling", "domain.periodic.y")));
}

TEST(CaseRules, SpheresAreInsideAndApart) {
  const auto place = [](v1::Case& c, double x, double y, double z) {
    c.mutable_particles()->clear_random();
    set_vector(c.mutable_particles()->mutable_placed()->add_spheres()->mutable_position(), x, y, z);
  };
  EXPECT_THAT(after([&](v1::Case& c) { place(c, 0, 0.12, 0.01), place(c, 0, 0.1195, 0.01); }), IsEmpty());  // overlap is allowed
  EXPECT_THAT(after([&](v1::Case& c) { place(c, 0.045, 0, 0); }),
              ElementsAre(fault_at("particles.placed.spheres[0].position.x", "outside the domain")));
  EXPECT_THAT(after([&](v1::Case& c) { place(c, 0.01, 0.01, 0), place(c, 0.02, 0.01, 0), place(c, 0.01, 0.01, 0); }),
              ElementsAre(fault_at("particles.placed.spheres[2].position", "spheres[0].position")));
}

TEST(CaseRules, LatticeIsNotDenserThanItsSpheres) {
  const auto lattice = [](std::uint32_t x) {
    return [=](v1::Case& c) {
      auto* count = c.mutable_particles()->mutable_lattice()->mutable_count();
      count->set_x(x);
      count->set_y(1);
      count->set_z(1);
    };
  };
  EXPECT_THAT(after(lattice(36)), IsEmpty());
  EXPECT_THAT(after(lattice(44)), ElementsAre(fault_at("particles.lattice.count.x", "use at most 36")));
}

// A monitor and what is to be said of it, at the path after "monitors[0]".
std::vector<CaseFault> of_monitor(
    const std::function<void(v1::Monitor&)>& fill, const Change& change = [](v1::Case&) {}) {
  return after([&](v1::Case& c) {
    c.add_monitors()->set_name("one");
    c.mutable_monitors(0)->mutable_averaging()->set_bin(1);
    fill(*c.mutable_monitors(0));
    change(c);
  });
}

TEST(CaseRules, MonitorsHaveNamesOfTheirOwn) {
  EXPECT_THAT(
      of_monitor([](v1::Monitor& m) { m.mutable_kinetic_energy(); }, [](v1::Case& c) { *c.add_monitors() = c.monitors(0); }),
      ElementsAre(fault_at("monitors[1].name", "as monitors[0].name is")));
}

TEST(CaseRules, MonitorsLieInsideTheDomain) {
  EXPECT_THAT(of_monitor([](v1::Monitor& m) { m.mutable_bed_height()->set_above(0.13); }),
              ElementsAre(fault_at("monitors[0].bed_height.above", "domain.size.y")));
  EXPECT_THAT(of_monitor([](v1::Monitor& m) { m.mutable_void_fraction()->set_height(0.13); }),
              ElementsAre(fault_at("monitors[0].void_fraction.height", "domain.size.y")));
  EXPECT_THAT(of_monitor([](v1::Monitor& m) {
                m.mutable_particle_velocity()->set_height(0.13);
                m.mutable_particle_velocity()->set_bins(3);
                m.mutable_particle_velocity()->set_depth_high(0.02);
              }),
              ElementsAre(fault_at("monitors[0].particle_velocity.height", "domain.size.y"),
                          fault_at("monitors[0].particle_velocity.depth_high", "domain.size.z")));
  EXPECT_THAT(of_monitor([](v1::Monitor& m) {
                m.mutable_pressure_drop()->set_low(0.01);
                m.mutable_pressure_drop()->set_high(0.13);
              }),
              ElementsAre(fault_at("monitors[0].pressure_drop.high", "domain.size.y")));
}

TEST(CaseRules, MonitorsOrderTheirEnds) {
  EXPECT_THAT(of_monitor([](v1::Monitor& m) {
                m.mutable_pressure_drop()->set_low(0.02);
                m.mutable_pressure_drop()->set_high(0.02);
              }),
              ElementsAre(fault_at("monitors[0].pressure_drop.high", "not above")));
  EXPECT_THAT(of_monitor([](v1::Monitor& m) {
                m.mutable_particle_velocity()->set_height(0.01);
                m.mutable_particle_velocity()->set_bins(3);
                m.mutable_particle_velocity()->set_depth_low(0.01);
              }),
              ElementsAre(fault_at("monitors[0].particle_velocity.depth_low", "domain.size.z")));
}

TEST(CaseRules, MonitorsNeedWhatTheyObserve) {
  const auto without_gas = [](v1::Case& c) { c.clear_gas(), c.clear_coupling(); };
  const auto without_particles = [](v1::Case& c) { c.clear_particles(), c.clear_coupling(), c.mutable_time()->set_step(1e-3); };
  const auto balance = [](v1::Monitor& m) { m.mutable_mass_balance(); };
  const auto exchange = [](v1::Monitor& m) { m.mutable_momentum_balance(); };
  const auto energy = [](v1::Monitor& m) { m.mutable_kinetic_energy(); };
  EXPECT_THAT(of_monitor(balance, without_gas), ElementsAre(fault_at("monitors[0].mass_balance", "no gas")));
  EXPECT_THAT(of_monitor(balance, without_particles), IsEmpty());
  EXPECT_THAT(of_monitor(exchange, without_gas), ElementsAre(fault_at("monitors[0].momentum_balance", "no gas")));
  EXPECT_THAT(of_monitor(exchange, without_particles), ElementsAre(fault_at("monitors[0].momentum_balance", "no particles")));
  EXPECT_THAT(of_monitor(energy, without_gas), IsEmpty());
  EXPECT_THAT(of_monitor(energy, without_particles), ElementsAre(fault_at("monitors[0].kinetic_energy", "no particles")));
}

TEST(CaseRules, ProfilesNeedAveraging) {
  EXPECT_THAT(of_monitor([](v1::Monitor& m) {
                m.mutable_void_fraction()->set_height(0.01);
                m.clear_averaging();
              }),
              ElementsAre(fault_at("monitors[0].averaging", "profile")));
}

TEST(CaseRules, AveragingMayReachBeyondTheEnd) {
  EXPECT_THAT(of_monitor([](v1::Monitor& m) {
                m.mutable_kinetic_energy();
                m.mutable_averaging()->set_start(1e5);
              }),
              IsEmpty());
}

TEST(CaseRules, ReferencesBelongToAMonitor) {
  const auto profile = [](v1::Monitor& m) { m.mutable_void_fraction()->set_height(0.01); };
  const auto reference = [](const std::string& monitor) {
    return [=](v1::Case& c) {
      auto* added = c.add_references();
      added->set_monitor(monitor);
      added->set_source("nobody");
      added->add_points()->set_value(1);
    };
  };
  EXPECT_THAT(of_monitor(profile, reference("two")), ElementsAre(fault_at("references[0].monitor", "is \"two\"")));
  EXPECT_THAT(of_monitor(profile, reference("one")), ElementsAre(fault_at("references[0].points[0].x", "one is a profile")));
  EXPECT_THAT(of_monitor([](v1::Monitor& m) { m.mutable_kinetic_energy(); }, reference("one")), IsEmpty());
}

// ---- contacts

v1::Hertz hertz() {
  v1::Hertz law;
  law.set_youngs_modulus(1e7);
  law.set_poisson_ratio(0.3);
  law.set_restitution(0.9);
  law.set_impact_speed(1);
  return law;
}

TEST(CaseRules, ATangentialSpringGoesWithItsNormalLaw) {
  EXPECT_THAT(after([](v1::Case& c) { c.mutable_particles()->mutable_mindlin()->set_friction(0.1); }),
              ElementsAre(fault_at("particles.mindlin", "particles.hertz")));
  EXPECT_THAT(after([](v1::Case& c) {
                *c.mutable_particles()->mutable_hertz() = hertz();
                c.mutable_particles()->mutable_mindlin()->set_friction(0.1);
              }),
              IsEmpty());
  EXPECT_THAT(after([](v1::Case& c) {
                *c.mutable_particles()->mutable_hertz() = hertz();
                c.mutable_particles()->mutable_spring()->set_friction(0.1);
              }),
              ElementsAre(fault_at("particles.spring", "use mindlin")));
}

TEST(CaseRules, WhatDoesNotTurnDoesNotRoll) {
  EXPECT_THAT(after([](v1::Case& c) {
                c.mutable_particles()->mutable_frictionless();
                c.mutable_particles()->mutable_constant_rolling()->set_friction(0.01);
              }),
              ElementsAre(fault_at("particles.constant_rolling", "particles.frictionless")));
}

TEST(CaseRules, PairsNameTypesAndReadableParameters) {
  EXPECT_THAT(after([](v1::Case& c) {
                v1::PairContact& pair = *c.mutable_particles()->add_pairs();
                pair.set_first("glass");
                pair.set_second("wall");
                pair.set_hamaker(1e-19);
              }),
              ElementsAre(fault_at("particles.pairs[0].first", "no particles.types"),
                          fault_at("particles.pairs[0].hamaker", "particles.van_der_waals")));
}

TEST(CaseRules, VelocityVerletGoesWithForcesFrozenOverTheStep) {
  EXPECT_THAT(after([](v1::Case& c) {
                c.mutable_particles()->mutable_velocity_verlet();
                c.mutable_coupling()->mutable_semi_implicit();
              }),
              ElementsAre(fault_at("particles.velocity_verlet", "coupling.semi_implicit")));
}

TEST(CaseRules, AnAttractionEndsBeyondWhereItStopsGrowing) {
  EXPECT_THAT(after([](v1::Case& c) {
                v1::VanDerWaals& law = *c.mutable_particles()->mutable_van_der_waals();
                law.set_hamaker(1e-19);
                law.set_nearest(1e-8);
                law.set_furthest(1e-9);
              }),
              ElementsAre(fault_at("particles.van_der_waals.furthest", "above nearest")));
}

}  // namespace
}  // namespace bedflow
