// The rules of what drives the gas and stands in its way: each speaks for its fault, at its path, and is silent otherwise.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "case_file.h"
#include "cases/ready_cases.h"
#include "support/case_faults.h"

namespace bedflow {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;

using Change = std::function<void(v1::Case&)>;

// Faults of a box of gas, 0.044 × 0.12 × 0.01 m of 18 × 48 × 4 cells, after a change.
std::vector<CaseFault> after(const Change& change) {
  v1::Case value = ready_case("mueller");
  value.clear_monitors();
  value.clear_references();
  value.clear_particles();
  value.clear_coupling();
  value.mutable_time()->set_step(1e-4);
  change(value);
  return check_case(value);
}

v1::Faces& faces(v1::Case& c) {
  return *c.mutable_domain()->mutable_faces();
}

void add_instants(google::protobuf::RepeatedPtrField<v1::Instant>* schedule, std::initializer_list<double> times) {
  for (const double time : times) {
    v1::Instant* instant = schedule->Add();
    instant->set_time(time);
    instant->set_share(0.5);
  }
}

void make_periodic(v1::Case& c) {
  c.mutable_domain()->mutable_periodic()->set_z(true);
  faces(c).clear_z_low();
  faces(c).clear_z_high();
}

v1::Panel& add_panel(v1::Case& c, double x0, double x1, double y0, double y1) {
  v1::Panel& panel = *c.mutable_domain()->add_panels();
  panel.mutable_low()->set_x(x0);
  panel.mutable_low()->set_y(y0);
  panel.mutable_high()->set_x(x1);
  panel.mutable_high()->set_y(y1);
  panel.mutable_high()->set_z(0.01);
  panel.mutable_baffle();
  return panel;
}

TEST(Schedules, AreInOrderAndAloneOnTheirJet) {
  const auto inflow = [](v1::Case& c) { return faces(c).mutable_y_low()->mutable_inflow(); };
  EXPECT_THAT(after([&](v1::Case& c) {
                inflow(c)->clear_ramp(), add_instants(inflow(c)->mutable_schedule(), {0, 1});
              }),
              IsEmpty());
  EXPECT_THAT(after([&](v1::Case& c) {
                inflow(c)->clear_ramp(), add_instants(inflow(c)->mutable_schedule(), {1, 1});
              }),
              ElementsAre(fault_at("domain.faces.y_low.inflow.schedule[1].time", "not after the instant before it, 1 s")));
  EXPECT_THAT(after([&](v1::Case& c) {
                inflow(c)->mutable_ramp()->set_duration(1);
                add_instants(inflow(c)->mutable_schedule(), {0});
              }),
              ElementsAre(fault_at("domain.faces.y_low.inflow.ramp", "remove one of the two")));
}

TEST(MassInflows, NeedAnOutflowAndLieWithinTheirFace) {
  const auto inflow = [](v1::Case& c) {
    auto* mass = faces(c).mutable_y_low()->mutable_mass_inflow();
    mass->set_mass_flow(1e-3);
    return mass;
  };
  EXPECT_THAT(after([&](v1::Case& c) { inflow(c); }), IsEmpty());
  EXPECT_THAT(after([&](v1::Case& c) { inflow(c), faces(c).mutable_y_high()->mutable_no_slip_wall(); }),
              ElementsAre(fault_at("domain.faces.y_low.mass_inflow", "set outflow")));
  EXPECT_THAT(after([&](v1::Case& c) {
                auto* rectangle = inflow(c)->mutable_rectangle();
                rectangle->mutable_low()->set_x(0.01);
                rectangle->mutable_high()->set_x(0.05);
                rectangle->mutable_high()->set_z(0.01);
              }),
              ElementsAre(fault_at("domain.faces.y_low.mass_inflow.rectangle.high.x", "at most domain.size.x, 0.044 m")));
}

TEST(Driving, IsOfAPeriodicDirectionAndOneOfTwoKinds) {
  const auto drive = [](v1::Case& c) { return c.mutable_gas()->mutable_driving()->mutable_z(); };
  EXPECT_THAT(after([&](v1::Case& c) { make_periodic(c), drive(c)->set_mass_flux(1); }), IsEmpty());
  EXPECT_THAT(after([&](v1::Case& c) { drive(c)->set_mass_flux(1); }),
              ElementsAre(fault_at("gas.driving.z", "domain.periodic.z is false")));
  EXPECT_THAT(after([&](v1::Case& c) { make_periodic(c), drive(c); }),
              ElementsAre(fault_at("gas.driving.z.pressure_drop", "set one of the two")));
  EXPECT_THAT(after([&](v1::Case& c) { make_periodic(c), drive(c)->set_mass_flux(1), drive(c)->set_pressure_drop(1); }),
              ElementsAre(fault_at("gas.driving.z.pressure_drop", "remove one of the two")));
  EXPECT_THAT(after([&](v1::Case& c) {
                make_periodic(c), drive(c)->set_pressure_drop(1);
                add_instants(drive(c)->mutable_schedule(), {0, 2, 1});
              }),
              ElementsAre(fault_at("gas.driving.z.schedule[2].time", "not after")));
}

TEST(Panels, AreRectanglesOnTheGridInsideTheBox) {
  EXPECT_THAT(after([](v1::Case& c) { add_panel(c, 0, 0.022, 0.03, 0.03); }), IsEmpty());
  EXPECT_THAT(after([](v1::Case& c) { add_panel(c, 0, 0.022, 0.03, 0.06); }),
              ElementsAre(fault_at("domain.panels[0].high", "flat along one")));
  EXPECT_THAT(after([](v1::Case& c) { add_panel(c, 0, 0.022, 0, 0); }),
              ElementsAre(fault_at("domain.panels[0].low.y", "inside the box")));
  EXPECT_THAT(after([](v1::Case& c) { add_panel(c, 0, 0.022, 0.031, 0.031); }),
              ElementsAre(fault_at("domain.panels[0].low.y", "the nearest is 0.03 m")));
  EXPECT_THAT(after([](v1::Case& c) { add_panel(c, 0, 0.05, 0.03, 0.03); }),
              Contains(fault_at("domain.panels[0].high.x", "domain.size.x, 0.044 m")));
  EXPECT_THAT(after([](v1::Case& c) { add_panel(c, 0, 0.022, 0.03, 0.03).clear_kind(); }),
              ElementsAre(fault_at("domain.panels[0].kind", "set one of baffle, plate")));
}

TEST(Panels, BaffleDoesNotStandAcrossAFluxThatIsHeld) {
  EXPECT_THAT(after([](v1::Case& c) {
                c.mutable_domain()->mutable_periodic()->set_y(true);
                faces(c).clear_y_low(), faces(c).clear_y_high();
                c.mutable_gas()->mutable_driving()->mutable_y()->set_mass_flux(1);
                add_panel(c, 0, 0.022, 0.03, 0.03);
              }),
              ElementsAre(fault_at("domain.panels[0].baffle", "drive that direction by pressure_drop")));
}

// Beside particles: 48 cells of 2.5 mm up the bed.
TEST(Panels, LeaveParticlesAFaceOnEitherSide) {
  v1::Case value = ready_case("mueller");
  add_panel(value, 0, 0.022, 0.03, 0.03);
  EXPECT_THAT(check_case(value), IsEmpty());
  add_panel(value, 0.022, 0.044, 0.0325, 0.0325);  // beside it, not above
  EXPECT_THAT(check_case(value), IsEmpty());
  add_panel(value, 0, 0.022, 0.0325, 0.0325);
  EXPECT_THAT(check_case(value), ElementsAre(fault_at("domain.panels[2].baffle", "one cell from domain.panels[0]")));
  value.mutable_domain()->mutable_panels(2)->mutable_plate();  // which lets gas through
  EXPECT_THAT(check_case(value), IsEmpty());
  add_panel(value, 0, 0.022, 0.0025, 0.0025);
  EXPECT_THAT(check_case(value), ElementsAre(fault_at("domain.panels[3].baffle", "one cell from a face")));
}

TEST(Panels, AreNotForAGaussian) {
  v1::Case value = ready_case("mueller");
  add_panel(value, 0, 0.022, 0.03, 0.03);
  value.mutable_coupling()->mutable_gaussian();
  EXPECT_THAT(check_case(value), ElementsAre(fault_at("coupling.gaussian", "domain.panels")));
}

TEST(TimeRules, LongestStepIsNotBelowTheStep) {
  EXPECT_THAT(after([](v1::Case& c) { c.mutable_time()->set_longest_step(1e-4); }), IsEmpty());
  EXPECT_THAT(after([](v1::Case& c) { c.mutable_time()->set_longest_step(1e-5); }),
              ElementsAre(fault_at("time.longest_step", "shorter than time.step")));
}

}  // namespace
}  // namespace bedflow
