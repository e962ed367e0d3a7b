// Surfaces of revolution with a profile of straight lines: cylinders, cones, discs, and what is put together of them (a hopper, a
// drum with its ends, a rod). Without thickness; touched from both sides.
//
// In the plane through the axis and the centre of a sphere, at (ρ, z), the surface is its profile and the mirror image at −ρ. The
// nearest point is on the profile; the image matters where the sphere sits in the tip of a cone and touches both its sides:
// there the force on it is a smooth function of ρ, and 0 across the axis on the axis.
#pragma once

#include <vector>

#include "geometry/touch.h"

namespace bedflow {

class Revolved {
 public:
  struct Corner {
    double radius = 0, height = 0;  // from the axis, and along it from the origin, m
  };

  // axis: any length but 0. profile: 2 corners or more. A profile that begins and ends on the axis is closed: only such a one
  // can tell who has passed it.
  Revolved(Vec3 origin, Vec3 axis, std::vector<Corner> profile, Keep keep = Keep::either);

  // A tube from one end of its axis to the other, closed by a disc at either end or not.
  static Revolved cylinder(Vec3 from, Vec3 to, double radius, bool closed, Keep keep = Keep::either);
  // A frustum, or with one radius 0 a cone.
  static Revolved cone(Vec3 from, Vec3 to, double radius_from, double radius_to, bool closed, Keep keep = Keep::either);

  void touch(Vec3 x, double reach, Touches& touches) const;
  bool passed(Vec3 x) const;
  Bounds bounds() const;

  bool closed() const { return profile_.front().radius == 0 && profile_.back().radius == 0; }
  Vec3 origin() const { return origin_; }
  Vec3 axis() const { return axis_; }

 private:
  struct Place {
    double radius, height;
    Vec3 outward;  // unit, from the axis to the place
  };
  Place place(Vec3 x) const;
  void touch_line(std::size_t line, Vec3 x, const Place& centre, double side, double reach, Touches& touches) const;

  Vec3 origin_, axis_, across_;  // axis and a direction across it, unit
  std::vector<Corner> profile_;
  Keep keep_;
};

}  // namespace bedflow
