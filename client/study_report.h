// A study for people: cost against error in a table and in a picture.
#pragma once

#include <filesystem>
#include <string>

#include "bedflow/v1/service.pb.h"
#include "table.h"

namespace bedflow::client {

// A line a run: what was varied, how far it is, what it costs, and for each quantity its value, its difference from the reference
// with the 95 % interval, and whether it is on the front.
void print_study(const v1::Study& study, Format format);
Table study_table(const v1::Study& study);
std::string reference_text(const v1::Study& study);  // what the reference run has along each axis

Table table_of(const std::vector<v1::Study>& studies);

// A panel a quantity: CPU seconds per simulated second along x, the difference from the reference along y, bars for its 95 %
// interval, runs of one axis joined, the front ringed.
std::string study_plot(const v1::Study& study, const std::filesystem::path& file);

bool has_ended(const v1::StudyRun& run);  // for good, or early as its interval is met
std::string study_state_name(v1::StudyState state);
std::string quantity_name(const v1::StudyQuantity& quantity);  // "bed_height", "bed_height fluctuation"
std::string point_name(const v1::StudySpec& spec, int point);  // "substeps=10", with all that differs from the reference

}  // namespace bedflow::client
