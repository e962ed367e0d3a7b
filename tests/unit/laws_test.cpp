// The schema and the code list the same laws: an arm without a law, or a law without an arm, is named here.
#include <gtest/gtest.h>

#include <set>
#include <string>

#include "bedflow/v1/case.pb.h"
#include "models/kernel.h"
#include "scene.h"

namespace bedflow {
namespace {

// Names of the arms of a choice.
std::set<std::string> arms(const google::protobuf::Descriptor* message, const char* choice) {
  const google::protobuf::OneofDescriptor* oneof = message->FindOneofByName(choice);
  EXPECT_NE(oneof, nullptr) << choice;
  std::set<std::string> names;
  for (int f = 0; oneof && f < oneof->field_count(); ++f) names.insert(oneof->field(f)->name());
  return names;
}

template <class Variant>
struct NamesOf;
template <class... Laws>
struct NamesOf<std::variant<Laws...>> {
  static std::set<std::string> get() { return {Laws::name...}; }
};
template <class... Laws>
struct NamesOf<std::variant<LawTable<Laws>...>> {
  static std::set<std::string> get() { return {Laws::name...}; }
};

// Of a choice that may be left out.
std::set<std::string> with_none(std::set<std::string> names) {
  names.insert("none");
  return names;
}

TEST(Laws, OfTheSchemaAreThoseOfTheCode) {
  EXPECT_EQ(arms(v1::Coupling::descriptor(), "drag"), NamesOf<Drag>::get());
  EXPECT_EQ(arms(v1::Particles::descriptor(), "contact"), NamesOf<ContactLaw>::get());
  EXPECT_EQ(arms(v1::Particles::descriptor(), "tangential"), NamesOf<TangentialLaw>::get());
  EXPECT_EQ(arms(v1::Gas::descriptor(), "solver"), (std::set<std::string>{"simple", "projection"}));
  EXPECT_EQ(arms(v1::Gas::descriptor(), "pressure_solver"),
            (std::set<std::string>{name(Preconditioner::multigrid), name(Preconditioner::incomplete_cholesky),
                                   name(Preconditioner::unpreconditioned)}));
  EXPECT_EQ(arms(v1::Gas::descriptor(), "convection"), NamesOf<Convection>::get());
  EXPECT_EQ(arms(v1::Panel::descriptor(), "kind"), NamesOf<decltype(Panel::kind)>::get());
  EXPECT_EQ(with_none(arms(v1::Particles::descriptor(), "rolling")), NamesOf<RollingLaw>::get());
  EXPECT_EQ(with_none(arms(v1::Particles::descriptor(), "cohesion")), NamesOf<CohesionLaw>::get());
  EXPECT_EQ(arms(v1::Face::descriptor(), "condition"), NamesOf<Boundary>::get());
  EXPECT_EQ(arms(v1::Monitor::descriptor(), "quantity"), NamesOf<Statistic>::get());
  EXPECT_EQ(arms(v1::ParticleType::descriptor(), "sizes"), NamesOf<SizeLaw>::get());
  EXPECT_EQ(arms(v1::Coupling::descriptor(), "kernel"), NamesOf<Kernel>::get());
  EXPECT_EQ(arms(v1::Coupling::descriptor(), "exchange"), NamesOf<ExchangeScheme>::get());
}

}  // namespace
}  // namespace bedflow
