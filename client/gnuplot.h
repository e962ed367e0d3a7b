// Pictures are drawn by gnuplot (package gnuplot-nox) through a pipe.
#pragma once

#include <array>
#include <filesystem>
#include <string>

namespace bedflow::client {

struct PictureSize {
  int width, height;  // pixels
};

// For lines beside each other, told apart on white; taken up again from the first when they are over.
inline constexpr std::array line_colours = {"#1f5fa8", "#e08214", "#1b7837", "#762a83", "#35978f", "#8c510a",
                                            "#c51b7d", "#4d4d4d", "#5aae61", "#2b8cbe", "#bf812d", "#7f3b08"};

// "set terminal" and "set output" for a PNG, and the look that all our pictures share.
std::string picture_head(const std::filesystem::path& file, PictureSize size);

std::string gnuplot_quoted(const std::string& text);

// Runs the script; throws Failure when gnuplot is missing, complains, or left no PNG at `file`.
void draw_picture(const std::string& script, const std::filesystem::path& file);

}  // namespace bedflow::client
