// The rules that join fields. Each names both; all are kept quiet by values that are absent or not finite, since the walker
// has reported those.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "case_file.h"

namespace bedflow {

using CaseFaults = std::vector<CaseFault>;

void check_scene(const v1::Case& value, CaseFaults& faults);            // what must be there together; time; grid and kernel
void check_faces(const v1::Case& value, CaseFaults& faults);            // periodic directions, walls, patches, balance of flows
void check_flow(const v1::Case& value, CaseFaults& faults);             // driven directions, panels
void check_particles(const v1::Case& value, CaseFaults& faults);        // types and sizes, contacts' reach
void check_contacts(const v1::Case& value, CaseFaults& faults);         // laws that go together, pairs of types
void check_seeding(const v1::Case& value, CaseFaults& faults);          // where they are at time 0
void check_particles(const v1::Case& value, CaseFaults& faults);        // where they are at time 0, contacts' reach
void check_coarse_graining(const v1::Case& value, CaseFaults& faults);  // what can be joined into parcels
void check_walls(const v1::Case& value, CaseFaults& faults);            // shapes, motions and meshes of walls within the box
void check_monitors(const v1::Case& value, CaseFaults& faults);         // monitors and the references that belong to them

constexpr std::array<const char*, 3> axis_names{"x", "y", "z"};

// Components by axis, 0 to 2, of Vector, Lengths, Cells and Directions.
template <typename Components>
auto component(const Components& value, std::size_t axis) {
  return axis == 0 ? value.x() : (axis == 1 ? value.y() : value.z());
}

// Whether this is the name of a face of the box: x_low …
bool is_face(const std::string& name);

// Reports where [low, high] along an axis is empty or reaches beyond the domain. `path` is that of the message with the
// corners low and high.
void check_extent(const v1::Case& value, const v1::Vector& low, const v1::Vector& high, std::size_t axis, const std::string& path,
                  CaseFaults& faults);

// Of all types together, or of one; 0 where the case does not say.
double largest_diameter(const v1::Particles& particles);
double largest_diameter(const v1::ParticleType& type);
double smallest_diameter(const v1::ParticleType& type);

using Instants = google::protobuf::RepeatedPtrField<v1::Instant>;
void check_schedule(const Instants& schedule, const std::string& path, CaseFaults& faults);  // in order

using TypeShares = google::protobuf::RepeatedPtrField<v1::TypeShare>;
const v1::ParticleType* type_named(const v1::Particles& particles, const std::string& name);  // null: there is none
void check_type_name(const v1::Particles& particles, const std::string& name, const std::string& path, CaseFaults& faults);
void check_shares(const v1::Particles& particles, const TypeShares& shares, const std::string& path, CaseFaults& faults);

}  // namespace bedflow
