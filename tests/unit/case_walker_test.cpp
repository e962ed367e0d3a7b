// The walker over the schema's options. Most tests go over every field of the schema, so a new parameter is tested as it comes.
#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <memory>
#include <set>

#include "bedflow/v1/options.pb.h"
#include "case_file.h"
#include "cases/ready_cases.h"
#include "support/case_faults.h"

namespace bedflow {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

const v1::Parameter& parameter_of(const FieldDescriptor* field) {
  return field->options().GetExtension(v1::parameter);
}

std::string child(const std::string& path, const std::string& name) {
  return path.empty() ? name : path + "." + name;
}

// A good case in which nearly every optional block is there.
v1::Case full_case() {
  v1::Case value = ready_case("mueller");
  value.clear_references();
  auto* reference = value.add_references();
  reference->set_monitor("bed_height");
  reference->set_source("nobody");
  reference->add_points()->set_value(0.02);
  value.mutable_gas()->mutable_initial_velocity()->set_y(0.1);
  value.mutable_particles()->set_skin(1e-4);
  value.mutable_domain()->mutable_faces()->mutable_x_low()->mutable_no_slip_wall()->mutable_velocity()->set_y(1);
  auto* inflow = value.mutable_domain()->mutable_faces()->mutable_y_low()->mutable_inflow();
  inflow->mutable_ramp()->set_duration(1);
  auto* patch = inflow->add_patches();
  patch->mutable_low()->set_x(0.01);
  patch->mutable_high()->set_x(0.02);
  patch->mutable_high()->set_z(0.01);
  patch->set_velocity(1);
  return value;
}

// Calls visit(message, field, path, options that bound it) for every field of every block that is there; repeated ones by item.
using Visit = std::function<void(Message&, const FieldDescriptor*, const std::string&, const v1::Parameter&)>;
void for_each_field(Message& message, const std::string& path, const v1::Parameter* bounds, const Visit& visit) {
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor* field = message.GetDescriptor()->field(i);
    const std::string place = child(path, field->name());
    const v1::Parameter& own = parameter_of(field);
    visit(message, field, place, bounds != nullptr ? *bounds : own);
    if (field->message_type() == nullptr) continue;
    const auto* access = message.GetReflection();
    if (field->is_repeated()) {
      for (int k = 0; k < access->FieldSize(message, field); ++k) {
        for_each_field(*access->MutableRepeatedMessage(&message, field, k), place + "[" + std::to_string(k) + "]", nullptr,
                       visit);
      }
    } else if (access->HasField(message, field)) {
      const bool is_vector = field->message_type() == v1::Vector::descriptor();
      for_each_field(*access->MutableMessage(&message, field), place, is_vector ? &own : nullptr, visit);
    }
  }
}

auto has_fault(const std::string& path, const std::string& text) {
  return Contains(fault_at(path, text));
}

void for_each_message(const Descriptor* type, std::set<const Descriptor*>& seen,
                      const std::function<void(const Descriptor*)>& visit) {
  if (!seen.insert(type).second) return;
  visit(type);
  for (int i = 0; i < type->field_count(); ++i) {
    if (type->field(i)->message_type() != nullptr) for_each_message(type->field(i)->message_type(), seen, visit);
  }
}
void for_each_message(const std::function<void(const Descriptor*)>& visit) {
  std::set<const Descriptor*> seen;
  for_each_message(v1::Case::descriptor(), seen, visit);
}

TEST(Schema, EveryFieldAndChoiceHasItsMeaning) {
  for_each_message([](const Descriptor* type) {
    for (int i = 0; i < type->field_count(); ++i)
      EXPECT_FALSE(parameter_of(type->field(i)).meaning().empty()) << type->field(i)->full_name();
    for (int i = 0; i < type->oneof_decl_count(); ++i) {
      EXPECT_FALSE(type->oneof_decl(i)->options().GetExtension(v1::choice).meaning().empty()) << type->oneof_decl(i)->full_name();
    }
  });
}

TEST(Schema, EveryNumberHasBounds) {
  for_each_message([](const Descriptor* type) {
    if (type == v1::Vector::descriptor()) return;  // bounded by the field it is the value of
    for (int i = 0; i < type->field_count(); ++i) {
      const FieldDescriptor* field = type->field(i);
      const v1::Parameter& parameter = parameter_of(field);
      const bool is_number = field->cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE ||
                             field->cpp_type() == FieldDescriptor::CPPTYPE_UINT32 ||
                             field->message_type() == v1::Vector::descriptor();
      if (!is_number) continue;
      EXPECT_TRUE(parameter.has_min() && parameter.has_max()) << field->full_name();
    }
  });
}

TEST(Schema, ListsHoldMessages) {
  for_each_message([](const Descriptor* type) {
    for (int i = 0; i < type->field_count(); ++i) {
      if (!type->field(i)->is_repeated()) continue;
      EXPECT_NE(type->field(i)->message_type(), nullptr) << type->field(i)->full_name();
    }
  });
}

TEST(CaseWalker, FullCaseIsGood) {
  EXPECT_THAT(check_case(full_case()), IsEmpty());
}

// Sets a number of any type for as long as it lives.
class Trial {
 public:
  Trial(Message& message, const FieldDescriptor* field, double value)
      : message_(message), field_(field), had_(message.GetReflection()->HasField(message, field)), before_(get()) {
    set(value);
  }
  ~Trial() {
    set(before_);
    if (!had_) message_.GetReflection()->ClearField(&message_, field_);
  }
  Trial(const Trial&) = delete;
  Trial& operator=(const Trial&) = delete;

 private:
  bool is_double() const { return field_->cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE; }
  double get() const {
    const auto* access = message_.GetReflection();
    return is_double() ? access->GetDouble(message_, field_) : access->GetUInt32(message_, field_);
  }
  void set(double value) {
    const auto* access = message_.GetReflection();
    if (is_double()) {
      access->SetDouble(&message_, field_, value);
    } else {
      access->SetUInt32(&message_, field_, static_cast<std::uint32_t>(value));
    }
  }

  Message& message_;
  const FieldDescriptor* field_;
  bool had_;
  double before_;
};

TEST(CaseWalker, NotANumberAndInfinityAreRefusedEverywhere) {
  v1::Case value = full_case();
  int tried = 0;
  for_each_field(value, "", nullptr,
                 [&](Message& message, const FieldDescriptor* field, const std::string& path, const v1::Parameter&) {
                   if (field->cpp_type() != FieldDescriptor::CPPTYPE_DOUBLE) return;
                   for (const double bad : {std::numeric_limits<double>::quiet_NaN(), -std::numeric_limits<double>::infinity()}) {
                     const Trial trial(message, field, bad);
                     EXPECT_THAT(check_case(value), has_fault(path, "finite"));
                     ++tried;
                   }
                 });
  EXPECT_GT(tried, 100);
}

TEST(CaseWalker, ValueBeyondABoundIsRefusedWithValueUnitAndRange) {
  v1::Case value = full_case();
  int tried = 0;
  for_each_field(value, "", nullptr,
                 [&](Message& message, const FieldDescriptor* field, const std::string& path, const v1::Parameter& parameter) {
                   const bool is_double = field->cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE;
                   if (!is_double && field->cpp_type() != FieldDescriptor::CPPTYPE_UINT32) return;
                   const std::string unit = parameter.unit() == "1" ? "" : parameter.unit();
                   const double size = std::max({1.0, std::abs(parameter.min()), std::abs(parameter.max())});
                   if (parameter.has_min() && (is_double || parameter.min() > 0)) {
                     const Trial trial(message, field,
                                       parameter.min_excluded() ? parameter.min() : parameter.min() - (is_double ? size : 1));
                     EXPECT_THAT(check_case(value),
                                 has_fault(path, unit + ": allowed is " + (parameter.min_excluded() ? "above " : "at least ")));
                     ++tried;
                   }
                   if (parameter.has_max() && (is_double || parameter.max() < 4e9)) {
                     const Trial trial(message, field, parameter.max() + size);
                     EXPECT_THAT(check_case(value), has_fault(path, "at most "));
                     ++tried;
                   }
                 });
  EXPECT_GT(tried, 100);
}

TEST(CaseWalker, ValueOnAnIncludedBoundIsTaken) {
  v1::Case value = full_case();
  value.mutable_particles()->set_steps_per_collision(8);
  value.mutable_particles()->mutable_linear_spring_dashpot()->set_restitution(1);
  EXPECT_THAT(check_case(value), IsEmpty());
}

TEST(CaseWalker, BoundsOfAVectorHoldForEachComponent) {
  v1::Case value = full_case();
  value.mutable_gravity()->set_z(2e4);
  EXPECT_THAT(check_case(value), has_fault("gravity.z", "is 20000 m/s²: allowed is at least -10000 and at most 10000 m/s²"));
}

TEST(CaseWalker, EachRequiredFieldIsMissed) {
  const v1::Case good = full_case();
  std::vector<std::string> required;
  v1::Case value = good;
  for_each_field(value, "", nullptr,
                 [&](Message& message, const FieldDescriptor* field, const std::string& path, const v1::Parameter&) {
                   if (parameter_of(field).required() && message.GetReflection()->HasField(message, field))
                     required.push_back(path);
                 });
  EXPECT_GT(required.size(), 40U);
  for (const std::string& wanted : required) {
    value = good;
    std::vector<std::pair<Message*, const FieldDescriptor*>> found;
    for_each_field(value, "", nullptr,
                   [&](Message& message, const FieldDescriptor* field, const std::string& path, const v1::Parameter&) {
                     if (path == wanted) found.emplace_back(&message, field);
                   });
    ASSERT_EQ(found.size(), 1U) << wanted;
    found[0].first->GetReflection()->ClearField(found[0].first, found[0].second);
    EXPECT_THAT(check_case(value), has_fault(wanted, "is missing: "));
  }
}

TEST(CaseWalker, MissingChoiceNamesItsBuiltArms) {
  v1::Case value = full_case();
  value.mutable_coupling()->clear_hat();
  value.mutable_particles()->clear_tangential();
  EXPECT_THAT(check_case(value),
              AllOf(has_fault("coupling.kernel", "; set one of hat, square_dpvm, garg, gaussian in coupling"),
                    has_fault("particles.tangential", "; set one of frictionless, coulomb, spring, mindlin in particles")));
}

TEST(CaseWalker, NamesMustMatchTheirPattern) {
  v1::Case value = full_case();
  value.set_name(std::string(200'000, 'A'));
  value.mutable_monitors(2)->set_name("2nd");
  const auto faults = check_case(value);
  EXPECT_THAT(faults, AllOf(has_fault("name", "it must match"), has_fault("monitors[2].name", "is \"2nd\": it must match")));
  for (const CaseFault& fault : faults) EXPECT_LT(fault.text.size(), 300U);
}

TEST(CaseWalker, TextMustBeUtf8WithoutControlCharacters) {
  v1::Case value = full_case();
  value.set_description("ε, 水, 🜁 and\nlines");
  EXPECT_THAT(check_case(value), IsEmpty());
  for (const std::string bad : {"\xff", "\xc3", "\xc0\xaf", "\xed\xa0\x80", "\xf5\x80\x80\x80", "a\x1b[2J", "\xe2\x82"}) {
    value.set_description(bad);
    EXPECT_THAT(check_case(value), has_fault("description", "UTF-8"));
  }
}

TEST(CaseWalker, ListsAreBoundedInLength) {
  v1::Case value = full_case();
  value.mutable_references(0)->clear_points();
  while (value.references_size() <= 64) *value.add_references() = value.references(0);
  value.mutable_references(1)->add_points()->set_value(1);
  EXPECT_THAT(check_case(value), AllOf(has_fault("references[0].points", "at least 1"), has_fault("references", "at most 64")));
}

TEST(CaseWalker, FieldsOfANewerVersionAreRefused) {
  v1::Case value = full_case();
  value.mutable_gas()->GetReflection()->MutableUnknownFields(value.mutable_gas())->AddVarint(999, 1);
  EXPECT_THAT(check_case(value), has_fault("gas", "number 999"));
}

TEST(CaseWalker, LongListOfFaultsIsCut) {
  v1::Case value = full_case();
  auto* placed = value.mutable_particles()->mutable_placed();
  for (int i = 0; i < 1000; ++i) placed->add_spheres();
  const auto faults = check_case(value);
  EXPECT_EQ(faults.size(), 201U);
  EXPECT_THAT(faults.back().text, HasSubstr("800 more"));
}

TEST(ParameterReference, HasEveryParameterUnitAndMeaning) {
  const std::string text = parameter_reference();
  for_each_message([&](const Descriptor* type) {
    EXPECT_THAT(text, HasSubstr("\n## " + type->name() + "\n"));
    for (int i = 0; i < type->field_count(); ++i) {
      EXPECT_THAT(text, HasSubstr("| `" + type->field(i)->name() + "` |"));
      EXPECT_THAT(text, HasSubstr("| " + parameter_of(type->field(i)).meaning() + " |"));
    }
  });
  EXPECT_THAT(text, HasSubstr("| `skin` | number | m |  | above 0 and at most 1 m |"));
  EXPECT_THAT(text, HasSubstr("| `steps_per_collision` | number | 1 | 20 | at least 8 and at most 10000 |"));
  EXPECT_THAT(text, HasSubstr("One is required of `upwind`, `smart`, `superbee`"));
}

TEST(BuiltLaws, AreTheArmsOfTheSchemasChoices) {
  const auto laws = built_laws();
  EXPECT_THAT(laws, AllOf(Contains("gas.solver.simple"), Contains("particles.tangential.spring"), Contains("coupling.kernel.hat"),
                          Contains("domain.faces.y_low.condition.inflow"), Contains("particles.contact.hertz")));
}

}  // namespace
}  // namespace bedflow
