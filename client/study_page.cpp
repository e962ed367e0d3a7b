#include "study_page.h"

#include <cctype>
#include <cmath>
#include <map>

#include "gnuplot.h"
#include "page.h"
#include "study_report.h"
#include "terminal.h"

namespace bedflow::client {

namespace {

// A name for files: "mueller: gas step" -> "mueller-gas-step".
std::string file_name(const std::string& name) {
  std::string text;
  for (const char c : name) {
    const bool is_plain = std::isalnum(static_cast<unsigned char>(c)) || c == '.' || c == '_';
    if (is_plain)
      text += c;
    else if (!text.empty() && text.back() != '-')
      text += '-';
  }
  while (text.ends_with('-')) text.pop_back();
  return text.empty() ? "study" : text;
}

// Each phase's share of its run; nothing when no run tells any. Phases that take less than half a per cent are left out.
std::string phases_text(const v1::Study& study) {
  const auto whole = [](const v1::StudyRun& run) {
    double sum = 0;
    for (const auto& phase : run.cost().phases()) sum += phase.seconds();
    return sum;
  };
  std::vector<std::string> columns = {"run"};
  std::map<std::string, std::size_t> column_of;
  for (const auto& run : study.runs()) {
    for (const auto& phase : run.cost().phases()) {
      if (phase.seconds() >= 0.005 * whole(run) && column_of.try_emplace(phase.phase(), columns.size()).second)
        columns.push_back(phase.phase());
    }
  }
  if (columns.size() == 1) return {};
  Table table(columns);
  for (int i = 0; i < study.runs_size(); ++i) {
    std::vector<Cell> row(columns.size());
    row[0] = point_name(study.spec(), i);
    for (const auto& phase : study.runs(i).cost().phases()) {
      if (const auto column = column_of.find(phase.phase()); column != column_of.end())
        row[column->second] = number_text(std::round(1000 * phase.seconds() / whole(study.runs(i))) / 10);
    }
    table.add(std::move(row));
  }
  return "\n## Where the time goes\n\nPer cent of each run.\n\n" + table.markdown();
}

// Why runs failed.
std::string failures_text(const v1::Study& study) {
  std::string text;
  for (int i = 0; i < study.runs_size(); ++i) {
    if (study.runs(i).state() == v1::FAILED)
      text += "\n" + point_name(study.spec(), i) + " failed: " + study.runs(i).message() + "\n";
  }
  return text;
}

}  // namespace

std::filesystem::path write_study_page(const std::filesystem::path& folder, const v1::Study& study) {
  make_folder(folder);
  const std::string name = file_name(study.spec().name());
  const auto picture = folder / (name + ".png");
  draw_picture(study_plot(study, picture), picture);
  write_text(folder / (name + ".json"), json_text(study, true));
  const auto& spec = study.spec();
  auto page = folder / (name + ".md");
  write_text(page, "# " + spec.name() + "\n\n" + made_by(spec.has_command() ? spec.command() : "bedflow study") +
                       "\nReference: " + reference_text(study) + ". Each other run differs from it as its line says." +
                       (spec.same_packing() ? " All whose particles are alike start from the same ones." : "") +
                       " Behind a ± is half the 95 % interval, from the scatter of bins of time; a difference has that of both "
                       "runs, and is *equal* when it lies within. *CPU s/s* are CPU seconds of all ranks per simulated second, "
                       "and an asterisk marks those that no other run is both cheaper and closer than.\n\n" +
                       study_table(study).markdown() + failures_text(study) + phases_text(study) +
                       "\n![cost against difference](" + picture.filename().string() + ")\n");
  return page;
}

}  // namespace bedflow::client
