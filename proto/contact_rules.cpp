#include <set>
#include <utility>

#include "case_rules.h"
#include "parameter_text.h"

namespace bedflow {
namespace {

constexpr const char* faces = "wall";

// Each tangential spring belongs to a normal law: its stiffness comes from it.
void check_springs(const v1::Particles& particles, CaseFaults& faults) {
  if (particles.has_mindlin() && particles.has_linear_spring_dashpot()) {
    faults.push_back({"particles.mindlin", "goes with particles.hertz, but particles.linear_spring_dashpot is set: use spring"});
  }
  if (particles.has_spring() && particles.has_hertz()) {
    faults.push_back({"particles.spring", "goes with particles.linear_spring_dashpot, but particles.hertz is set: use mindlin"});
  }
}

void check_rolling(const v1::Particles& particles, CaseFaults& faults) {
  const bool rolls = particles.has_constant_rolling() || particles.has_spring_rolling();
  if (rolls && particles.has_frictionless()) {
    faults.push_back({particles.has_constant_rolling() ? "particles.constant_rolling" : "particles.spring_rolling",
                      "needs particles that turn, but particles.frictionless is set: choose coulomb, spring or mindlin"});
  }
}

void check_reach(const v1::Particles& particles, CaseFaults& faults) {
  const v1::VanDerWaals& law = particles.van_der_waals();
  if (law.has_furthest() && !(law.furthest() > law.nearest())) {
    faults.push_back({"particles.van_der_waals.furthest", "is " + number_text(law.furthest()) + " m: it must be above nearest, " +
                                                              number_text(law.nearest()) + " m"});
  }
}

// A parameter that the chosen laws do not read.
void check_read(const v1::Particles& particles, const v1::PairContact& pair, const std::string& path, CaseFaults& faults) {
  const auto check = [&](bool given, bool read, const char* field, const char* laws) {
    if (given && !read) faults.push_back({path + "." + field, std::string("is read by ") + laws + " only: remove it"});
  };
  check(pair.has_stiffness(), particles.has_linear_spring_dashpot(), "stiffness", "particles.linear_spring_dashpot");
  check(pair.has_modulus(), particles.has_hertz(), "modulus", "particles.hertz");
  check(pair.has_shear_modulus(), particles.has_mindlin(), "shear_modulus", "particles.mindlin");
  check(pair.has_friction(), !particles.has_frictionless(), "friction", "particles.coulomb, spring and mindlin");
  check(pair.has_rolling_friction(), particles.has_constant_rolling() || particles.has_spring_rolling(), "rolling_friction",
        "particles.constant_rolling and spring_rolling");
  check(pair.has_hamaker(), particles.has_van_der_waals(), "hamaker", "particles.van_der_waals");
}

void check_pairs(const v1::Case& value, CaseFaults& faults) {
  const v1::Particles& particles = value.particles();
  std::set<std::string> walls{faces};
  for (const v1::Wall& wall : value.walls()) walls.insert(wall.name());
  std::set<std::pair<std::string, std::string>> seen;
  for (int i = 0; i < particles.pairs_size(); ++i) {
    const v1::PairContact& pair = particles.pairs(i);
    const std::string path = item_path("particles.pairs", i);
    check_type_name(particles, pair.first(), path + ".first", faults);
    if (!walls.contains(pair.second()) && !type_named(particles, pair.second())) {
      std::string names;
      for (const v1::ParticleType& type : particles.types()) names += type.name() + ", ";
      for (const v1::Wall& wall : value.walls()) names += wall.name() + ", ";
      faults.push_back({path + ".second", "is \"" + pair.second() + "\": it must be one of " + names + faces});
    }
    if (!seen.insert(std::minmax(pair.first(), pair.second())).second)
      faults.push_back({path, "is the second one of " + pair.first() + " and " + pair.second() + ": put all into one"});
    check_read(particles, pair, path, faults);
  }
  for (int i = 0; i < particles.types_size(); ++i)
    if (walls.contains(particles.types(i).name()))
      faults.push_back({item_path("particles.types", i) + ".name",
                        "is " + particles.types(i).name() + ", which is a wall in particles.pairs: rename it"});
}

// The force of the gas in these exchanges takes the velocity at the start of a sub-step.
void check_integrator(const v1::Case& value, CaseFaults& faults) {
  const v1::Coupling& coupling = value.coupling();
  if (value.particles().has_velocity_verlet() && (coupling.has_sub_stepped() || coupling.has_semi_implicit())) {
    faults.push_back({"particles.velocity_verlet", std::string("goes with coupling.explicit, but coupling.") +
                                                       (coupling.has_sub_stepped() ? "sub_stepped" : "semi_implicit") +
                                                       " is set: use symplectic_euler"});
  }
}

}  // namespace

void check_contacts(const v1::Case& value, CaseFaults& faults) {
  if (!value.has_particles()) return;
  check_springs(value.particles(), faults);
  check_rolling(value.particles(), faults);
  check_reach(value.particles(), faults);
  check_pairs(value, faults);
  check_integrator(value, faults);
}

}  // namespace bedflow
