// What the runs of a study say: quantities with their intervals, differences from the reference, and which runs are worth their
// cost. Pure functions of statistics; studies.h decides what runs.
#pragma once

#include <vector>

#include "bedflow/v1/service.pb.h"

namespace bedflow::server {

// A quantity of one run: one value, or one a place of a profile. Half of the 95 % interval, NaN with fewer than two bins.
struct Measured {
  std::vector<double> mean, half_width;
  std::uint32_t bins = 0;  // of time, complete
};

// NaN at places where nothing was seen; empty when the statistics have no bin of the monitor.
Measured measured(const v1::Statistics& statistics, const v1::StudyQuantity& quantity);

// Of a profile the root mean squares over its places.
v1::Estimate overall(const Measured& quantity);

// Run less reference. The runs are independent once the bed is chaotic, so half-widths add in squares. Equal: the difference is
// not larger than its half-width; for a profile both are root mean squares over the places that both have seen.
v1::StudyError difference(const Measured& run, const Measured& reference);

bool is_narrow_enough(const Measured& quantity, const v1::StudyStop& stop);

// Fills runs[i].on_front for every quantity: no other run that has a cost and an error is at least as cheap and as close, and
// better in one. Of an error that is equal to the reference's within the interval nothing is known: it counts as none.
void mark_front(v1::Study& study);

}  // namespace bedflow::server
