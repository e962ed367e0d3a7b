// The walls of the scene beside the faces of the box: where particles touch them, and what these contacts remember.
//
// Of each wall a list of the particles near it, with the facets near them, holds while neither has moved too far: particles
// skin/2 from their places at the last rebuild of the pair list, the wall skin/2 since the list was made. It says only whom to
// ask: what is asked does not depend on when it was made.
//
// The contacts of a wall with a particle are told apart by their normals, which differ by more than a feature angle: the one
// whose normal has turned least is the same contact, whatever the facet.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "geometry/wall.h"
#include "particles/history.h"
#include "particles/wall_sweep.h"

namespace bedflow {

class Walls {
 public:
  // reach: of the largest particle and its moves, beyond the box (m).
  Walls(std::vector<Wall> walls, Vec3 box_size, double reach);

  std::size_t size() const { return parts_.size(); }

  // Finds the contacts at `time`; absent: the walls rest where they are at time 0. places: of the owned particles at the last
  // rebuild.
  void meet(const DemSetup& setup, const ParticleStore& particles, std::span<const Vec3> places, std::optional<double> time,
            double now);
  // Calls take(contact) for the contacts found that are nearer than the particle's radius plus `range`; loads: behind those of
  // the faces.
  template <class Take>
  WallResult each_contact(std::vector<WallLoad>& loads, double range, Take take) {
    WallResult result{0, passed_};
    for (Meeting& meeting : met_) {
      WallContact& c = meeting.contact;
      if (!(c.touching.overlap > -range)) continue;
      result.deepest = max(result.deepest, c.touching.overlap / (2 * c.radius));
      WallLoad& load = loads[box_faces_count + meeting.wall];
      c.wall_force = &load.force;
      c.wall_torque = &load.torque;
      c.power = &power_;
      c.displacement = &meeting.displacement;
      c.angle = &meeting.angle;
      take(c);
    }
    return result;
  }
  // What the walls have put into the particles since the last take, the sum over the sub-steps, W.
  double take_power() { return std::exchange(power_, 0); }
  // The name of a wall that a place is on the wrong side of at the time of the last meet(); null: of none,
  // or there was none since the last load().
  const std::string* passed(Vec3 place) const;

  // Hands the memory of what touched in sub-step `now` over to the particles; takes it back for rows in a new
  // order, of which new lists are made.
  void save(double now, ContactHistory& history) const;
  void load(double now, const ContactHistory& history, std::size_t particles);
  std::vector<WallHistory> histories(const ParticleStore& particles, double now) const;

 private:
  static constexpr std::size_t box_faces_count = 6;
  struct Near {
    std::uint32_t particle, first, last;  // facets
  };
  struct Part {
    Wall wall;
    Bounds bounds;       // of the surface at rest, within the domain where it has no end
    Vec3 reference;      // at time 0 of what a load's torque is about
    bool slides, moves;  // along itself; at all
    double listed_at = 0;
    std::vector<Near> near{};
    std::vector<std::uint32_t> facets{};
    Pose frame{}, pose{};  // of the surface; of its material
  };
  struct Meeting {
    WallContact contact;
    std::uint32_t wall;
    MemoryRow displacement, angle;
  };
  void place(Part& part, std::optional<double> time) const;
  void list(Part& part, const DemSetup& setup, const ParticleStore& particles, std::span<const Vec3> places);
  template <class Shape>
  void meet_part(const Shape& shape, std::size_t index, const DemSetup& setup, const ParticleStore& particles, double now);
  void recall(Meeting& meeting, double now);

  std::vector<Part> parts_;
  std::vector<Meeting> met_, before_;  // in this sub-step and in the one before; by wall, then by row
  std::size_t behind_ = 0;             // of before_: those of earlier particles
  Touches touches_;
  bool listed_ = false, passed_ = false;
  double power_ = 0;
};

}  // namespace bedflow
