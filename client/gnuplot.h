// Pictures are drawn by gnuplot (package gnuplot-nox) through a pipe.
#pragma once

#include <filesystem>
#include <string>

namespace bedflow::client {

struct PictureSize {
  int width, height;  // pixels
};

// "set terminal" and "set output" for a PNG, and the look that all our pictures share.
std::string picture_head(const std::filesystem::path& file, PictureSize size);

std::string gnuplot_quoted(const std::string& text);

// Runs the script; throws Failure when gnuplot is missing, complains, or left no PNG at `file`.
void draw_picture(const std::string& script, const std::filesystem::path& file);

}  // namespace bedflow::client
