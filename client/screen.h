// The whole terminal for a program that draws itself anew: another screen, keys as they are pressed, and all as before at the
// end.
#pragma once

#include <termios.h>

#include <optional>
#include <string>
#include <vector>

#include "terminal.h"

namespace bedflow::client {

class Screen {
 public:
  Screen();
  ~Screen() { leave(); }
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  const Terminal& terminal() const { return terminal_; }
  int rows() const;
  // What fits of the lines, from the top; they may have colours.
  void draw(const std::vector<std::string>& lines);
  std::optional<char> key(int milliseconds);  // Ctrl-C is '\3'; Ctrl-Z has been dealt with
  bool has_ended() const { return ended_; }   // nobody is at the other end of the terminal any more

 private:
  void enter();
  void leave();
  void suspend();

  Terminal terminal_{stdout};
  std::optional<termios> before_;  // none: no keys come
  bool ended_ = false;
};

// The first columns of a line, its colours closed.
std::string cut(const std::string& line, int columns);

}  // namespace bedflow::client
