#include "gnuplot.h"

#include <fstream>
#include <system_error>

#include "child.h"
#include "failure.h"

namespace bedflow::client {

std::string gnuplot_quoted(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c == '\n' ? ' ' : c;
  }
  return quoted + "\"";
}

std::string picture_head(const std::filesystem::path& file, PictureSize size) {
  return "set encoding utf8\n"
         "set terminal pngcairo noenhanced size " +
         std::to_string(size.width) + "," + std::to_string(size.height) +
         " font \"DejaVu Sans,13\" linewidth 1.4 background rgb \"#ffffff\"\n"
         "set output " +
         gnuplot_quoted(file.string()) +
         "\n"
         "set datafile missing \"NaN\"\n"
         "set border 3 lw 1 lc rgb \"#444444\"\n"
         "set tics nomirror out scale 0.6 textcolor rgb \"#222222\"\n"
         "set grid lt 1 lw 0.5 lc rgb \"#dddddd\"\n";
}

void draw_picture(const std::string& script, const std::filesystem::path& file) {
  std::error_code ignored;
  const auto folder = std::filesystem::absolute(file).parent_path();
  if (!std::filesystem::is_directory(folder)) {
    throw Failure(Exit::usage, "the folder " + folder.string() + " for the picture does not exist",
                  "mkdir -p " + folder.string());
  }
  std::filesystem::remove(file, ignored);
  ChildResult result;
  try {
    result = run_child({"gnuplot"}, script);
  } catch (const std::system_error& error) {
    if (error.code() != std::errc::no_such_file_or_directory) throw;
    throw Failure(Exit::other, "pictures need gnuplot, which is not installed", "apt-get install gnuplot-nox");
  }
  std::string signature(4, '\0');
  std::ifstream(file, std::ios::binary).read(signature.data(), 4);
  if (result.exit_code == 0 && signature == "\x89PNG") return;
  throw Failure(Exit::other, "gnuplot could not draw " + file.string() + ": " + result.error.substr(0, 600), "gnuplot --version");
}

}  // namespace bedflow::client
