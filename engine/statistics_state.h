// The sums of the monitors as part of a checkpoint: statistics go on where it left them.
#pragma once

#include "checkpoint/checkpoint.h"
#include "statistics/monitors.h"

namespace bedflow {

void add_statistics(const Monitors& monitors, CheckpointContent& content);

// False when the checkpoint's sums belong to other monitors; these begin anew then.
bool restore_statistics(const CheckpointReader& reader, Monitors& monitors);

}  // namespace bedflow
