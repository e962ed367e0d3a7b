#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "stl.h"

namespace bedflow {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<StlTriangle> tetrahedron() {
  const StlPoint o{0, 0, 0}, x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
  return {{o, y, x}, {o, x, z}, {o, z, y}, {x, y, z}};
}

std::string as_text(const std::vector<StlTriangle>& triangles) {
  std::string text = "solid a vertex of names\n";
  for (const StlTriangle& t : triangles) {
    text += " facet normal 0 0 0\n  outer loop\n";
    for (const StlPoint& v : t)
      text += "   vertex " + std::to_string(v[0]) + " " + std::to_string(v[1]) + " +" + std::to_string(v[2]) + "\r\n";
    text += "  endloop\n endfacet\n";
  }
  return text + "endsolid a vertex of names\n";
}

std::string as_binary(const std::vector<StlTriangle>& triangles) {
  std::string bytes = "solid, as some programs begin a binary file";
  bytes.resize(80, ' ');
  const auto append = [&](const auto& value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof value); };
  append(static_cast<std::uint32_t>(triangles.size()));
  for (const StlTriangle& t : triangles) {
    for (int n = 0; n < 3; ++n) append(0.0F);
    for (const StlPoint& v : t)
      for (int d = 0; d < 3; ++d) append(static_cast<float>(v[d]));
    append(static_cast<std::uint16_t>(0));
  }
  return bytes;
}

TEST(Stl, TextAndBinaryAreTheSameTriangles) {
  for (const std::string& bytes : {as_text(tetrahedron()), as_binary(tetrahedron())}) {
    const StlRead read = read_stl(bytes);
    EXPECT_EQ(read.fault, "");
    EXPECT_EQ(read.triangles, tetrahedron());
  }
}

TEST(Stl, SeveralSolidsOfATextAreOne) {
  EXPECT_EQ(read_stl(as_text(tetrahedron()) + as_text(tetrahedron())).triangles.size(), 8U);
}

TEST(Stl, WhatIsNoStlIsRefusedWithTheReason) {
  EXPECT_THAT(read_stl("").fault, HasSubstr("neither"));
  EXPECT_THAT(read_stl(std::string(200, 'x')).fault, HasSubstr("bytes of a binary file"));
  const std::string binary = as_binary(tetrahedron());
  EXPECT_NE(read_stl(std::string_view(binary).substr(0, binary.size() - 7)).fault, "");  // begins with solid, but is no text
  const std::string text = as_text(tetrahedron());
  EXPECT_THAT(read_stl(std::string_view(text).substr(0, text.size() / 2)).fault, HasSubstr("line "));
  EXPECT_THAT(read_stl("solid\nendsolid\n").fault, HasSubstr("no triangle"));
  EXPECT_THAT(read_stl("solid\nfacet\nvertex 1 2 x\nendsolid").fault, HasSubstr("line 3: a vertex needs three numbers"));
  EXPECT_THAT(read_stl("solid\nfacet\nvertex 1 2 3\nendfacet\nendsolid").fault, HasSubstr("line 4: a facet with 1 corners"));
  EXPECT_THAT(read_stl("solid\nfacet\nvertex 1 2 3\nvertex 1 2 nan\nvertex 2 2 3\nendfacet\nendsolid").fault,
              HasSubstr("triangle 1 has a coordinate that is not a finite number"));
}

TEST(Stl, ASoundBodyHasNoFaults) {
  EXPECT_THAT(mesh_faults(tetrahedron(), false), IsEmpty());
  auto signs = tetrahedron();
  signs[1][0] = {-0.0, 0.0, -0.0};
  EXPECT_THAT(mesh_faults(signs, false), IsEmpty());
}

TEST(Stl, AHoleIsNamedByItsEdges) {
  auto open = tetrahedron();
  open.pop_back();
  const auto faults = mesh_faults(open, false);
  ASSERT_EQ(faults.size(), 3U);
  EXPECT_EQ(faults[0], "edge (0, 1, 0) – (1, 0, 0) belongs to triangle 1 alone: a hole");
  EXPECT_THAT(mesh_faults(open, true), IsEmpty());  // an open sheet may have rims
}

TEST(Stl, MoreThanTwoTrianglesAtAnEdge) {
  auto fin = tetrahedron();
  fin.push_back({StlPoint{0, 0, 0}, StlPoint{1, 0, 0}, StlPoint{0.5, -1, 0}});
  EXPECT_THAT(
      mesh_faults(fin, true),
      ElementsAre("edge (0, 0, 0) – (1, 0, 0) belongs to triangles 2, 5, 1: more than two meet there (a wall of its own for "
                  "the other part)"));
}

TEST(Stl, WindingAgainstEachOther) {
  auto twisted = tetrahedron();
  std::swap(twisted[3][0], twisted[3][1]);
  const auto faults = mesh_faults(twisted, false);
  ASSERT_EQ(faults.size(), 3U);
  EXPECT_EQ(faults[0], "edge (0, 1, 0) – (1, 0, 0) belongs to triangles 1, 4, which are wound against each other");
}

TEST(Stl, TrianglesWithoutArea) {
  const std::vector<StlTriangle> flat{{StlPoint{0, 0, 0}, StlPoint{1, 0, 0}, StlPoint{0.5, 1e-9, 0}},
                                      {StlPoint{2, 0, 0}, StlPoint{2, 0, 0}, StlPoint{3, 0, 0}}};
  const auto faults = mesh_faults(flat, true);
  ASSERT_GE(faults.size(), 2U);
  EXPECT_EQ(faults[0], "triangle 1, (0, 0, 0) (1, 0, 0) (0.5, 1e-09, 0), has no area");
  EXPECT_THAT(faults[1], HasSubstr("triangle 2"));
}

TEST(Stl, ManyFaultsAreCounted) {
  std::vector<StlTriangle> scattered;
  scattered.reserve(30);
  for (int n = 0; n < 30; ++n)
    scattered.push_back({StlPoint{3.0 * n, 0, 0}, StlPoint{3.0 * n + 1, 0, 0}, StlPoint{3.0 * n, 1, 0}});
  const auto faults = mesh_faults(scattered, false);
  ASSERT_EQ(faults.size(), 21U);
  EXPECT_EQ(faults.back(), "and 70 more");
}

}  // namespace
}  // namespace bedflow
