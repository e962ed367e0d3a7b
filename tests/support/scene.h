// Scenes from the text of a case, for tests of the whole engine.
#pragma once

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "case/case_scene.h"
#include "simulation.h"

namespace bedflow {

// A folder that is gone with the test. All ranks share the one of rank 0.
class TestFolder {
 public:
  explicit TestFolder(const Comm& comm) : comm_(comm) {
    static int count = 0;
    const std::string name = "bedflow_test_" + std::to_string(getpid()) + "_" + std::to_string(++count);
    const std::string mine = (std::filesystem::temp_directory_path() / name).string();
    path_ = comm.broadcast(mine);
    if (comm.root()) std::filesystem::create_directories(path_);
    comm.barrier();
  }
  ~TestFolder() {
    comm_.barrier();
    std::error_code none;
    if (comm_.root()) std::filesystem::remove_all(path_, none);
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  const Comm& comm_;
  std::filesystem::path path_;
};

inline Scene scene_of(const Comm& comm, const std::string& case_text) {
  const TestFolder folder(comm);
  if (comm.root()) std::ofstream(folder.path() / "case.txtpb") << case_text;
  comm.barrier();
  return read_scene(folder.path() / "case.txtpb");
}

// The text with `old`, which must be there, replaced.
inline std::string with(std::string text, const std::string& old, const std::string& replacement) {
  return text.replace(text.find(old), old.size(), replacement);
}

// A small fluidized bed: 15 × 36 × 10 mm, 600 particles, walls all round, both laws with and without history.
inline std::string small_bed(const std::string& tangential, const std::string& more = "") {
  return R"(name: "small-bed"
    domain { size { x: 0.015 y: 0.036 z: 0.01 } cells { x: 6 y: 14 z: 4 }
      faces { y_low { inflow { velocity: 0.9 } } y_high { outflow {} } z_low { free_slip_wall {} } z_high { free_slip_wall {} } } }
    gravity { y: -9.81 }
    gas { density: 1.2 viscosity: 1.8e-5 simple {} upwind {} }
    particles { diameter: 0.0012 density: 1000 linear_spring_dashpot { stiffness: 440 restitution: 0.9 } symplectic_euler {}
      random { count: 600 seed: 3 velocity_deviation: 0.05 region { low {} high { x: 0.015 y: 0.018 z: 0.01 } } } )" +
         tangential + R"( }
    coupling { gidaspow_blended {} hat {} explicit {} }
    time { end: 1 } )" +
         more;
}

}  // namespace bedflow
