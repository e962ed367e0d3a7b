// Series and profiles with their 95 % half-widths, for people and for programs.
#pragma once

#include <string>

#include "bedflow/v1/results.pb.h"
#include "table.h"

namespace bedflow::client {

// "0.0321 ± 0.0004": two digits of the half-width, as many of the mean. The mean alone without an interval, "-" without bins.
std::string estimate_text(const v1::Estimate& estimate);

void print_statistics(const v1::Statistics& statistics, Format format);

// The samples of the series themselves: name, step, time, value; of groups minimum, maximum and number too.
void print_samples(const v1::Statistics& statistics, Format format);

}  // namespace bedflow::client
