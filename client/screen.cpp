#include "screen.h"

#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>

namespace bedflow::client {

Screen::Screen() {
  termios now{};
  if (tcgetattr(STDIN_FILENO, &now) == 0) before_ = now;
  enter();
}

void Screen::enter() {
  if (before_) {
    termios keys = *before_;
    keys.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO | ISIG);
    keys.c_cc[VMIN] = 0;
    keys.c_cc[VTIME] = 0;
    tcsetattr(STDIN_FILENO, TCSANOW, &keys);
  }
  std::fputs("\033[?1049h\033[?25l", stdout);  // another screen, no cursor
  std::fflush(stdout);
}

void Screen::leave() {
  std::fputs("\033[?25h\033[?1049l", stdout);
  std::fflush(stdout);
  if (before_) tcsetattr(STDIN_FILENO, TCSANOW, &*before_);
}

void Screen::suspend() {
  leave();
  raise(SIGSTOP);
  enter();
}

int Screen::rows() const {
  winsize size{};
  return ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_row > 0 ? size.ws_row : 24;
}

void Screen::draw(const std::vector<std::string>& lines) {
  const auto most = static_cast<std::size_t>(rows());
  std::string text = "\033[H";
  for (std::size_t i = 0; i < lines.size() && i < most; ++i)
    text += (i ? "\r\n" : "") + cut(lines[i], terminal_.width()) + "\033[K";
  text += "\033[J";
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0) ended_ = true;
}

std::optional<char> Screen::key(int milliseconds) {
  pollfd input{before_ && !ended_ ? STDIN_FILENO : -1, POLLIN, 0};
  if (poll(&input, 1, milliseconds) <= 0) return std::nullopt;
  char key = 0;
  const auto got = read(STDIN_FILENO, &key, 1);
  if (got <= 0 && (input.revents & POLLHUP) != 0) ended_ = true;
  if (got <= 0) return std::nullopt;
  constexpr char ctrl_z = 26;
  if (key == ctrl_z) suspend();
  return key;
}

std::string cut(const std::string& line, int columns) {
  std::string text;
  int used = 0;
  bool control = false, coloured = false;
  for (const char c : line) {
    const bool continuation = (static_cast<unsigned char>(c) & 0xC0) == 0x80;
    if (c == '\033') control = coloured = true;
    if (!control && !continuation && used++ >= columns) break;
    text += c;
    if (control && c == 'm') control = false;
  }
  return coloured ? text + "\033[0m" : text;
}

}  // namespace bedflow::client
