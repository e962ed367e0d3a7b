#include "mesh_file.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>

#include "parameter_text.h"
#include "stl.h"

namespace bedflow {
namespace {

void set(v1::Vector& vector, const StlPoint& point) {
  vector.set_x(point[0]);
  vector.set_y(point[1]);
  vector.set_z(point[2]);
}

// Why the file gives no triangles; empty: it does.
std::string inline_file(v1::MeshWall& mesh, const std::filesystem::path& path) {
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  std::ostringstream bytes;
  if (file && !std::filesystem::is_directory(path)) bytes << file.rdbuf();
  if (!file || std::filesystem::is_directory(path)) {
    return "cannot be read: " + std::string(std::filesystem::is_directory(path) ? "is a folder" : std::strerror(errno));
  }
  const StlRead read = read_stl(bytes.view());
  if (!read.fault.empty()) return "is no STL file: " + read.fault;
  for (const StlTriangle& corners : read.triangles) {
    v1::Triangle& triangle = *mesh.add_triangles();
    set(*triangle.mutable_a(), corners[0]);
    set(*triangle.mutable_b(), corners[1]);
    set(*triangle.mutable_c(), corners[2]);
  }
  mesh.clear_file();
  return "";
}

}  // namespace

bool inline_mesh_files(v1::Case& value, const std::filesystem::path& folder, std::vector<CaseFault>& faults) {
  const std::size_t before = faults.size();
  for (int i = 0; i < value.walls_size(); ++i) {
    if (!value.walls(i).mesh().has_file()) continue;
    const std::filesystem::path path = folder / value.walls(i).mesh().file();
    const std::string fault = inline_file(*value.mutable_walls(i)->mutable_mesh(), path);
    if (!fault.empty()) faults.push_back({item_path("walls", i) + ".mesh.file", path.string() + " " + fault});
  }
  return faults.size() == before;
}

}  // namespace bedflow
