#include "page.h"

#include <ctime>
#include <fstream>

#include "failure.h"

namespace bedflow::client {

std::string made_by(const std::string& command) {
  const std::time_t now = std::time(nullptr);
  char day[16];
  std::strftime(day, sizeof day, "%Y-%m-%d", std::gmtime(&now));
  return "Made by `" + command + "`, bedflow " BEDFLOW_VERSION ", " + day + ".\n";
}

void make_folder(const std::filesystem::path& folder) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) throw Failure(Exit::other, "the folder " + folder.string() + " cannot be made: " + failed.message());
}

void write_text(const std::filesystem::path& file, const std::string& text) {
  if (!(std::ofstream(file) << text).flush())
    throw Failure(Exit::limit, "the file " + file.string() + " cannot be written: is the disk full?");
}

}  // namespace bedflow::client
