// Plans for whoever asks again and again and cannot wait for a program to start: the server.
#pragma once

#include <iosfwd>

namespace bedflow {

// A question is a line "RANKS BYTES"
// and so many bytes of a case, its answer a line "CODE BYTES" and so many bytes: a PlanReport in text format with code 0, else
// the faults, a line each, with the exit code that --plan has for them. Until the input ends; false when a question is none.
bool answer_plans(std::istream& questions, std::ostream& answers);

}  // namespace bedflow
