#include "plan_answers.h"

#include <exception>
#include <istream>
#include <ostream>
#include <string>

#include "base/stop.h"
#include "case/case_scene.h"
#include "plan.h"
#include "report/plan_report.h"

namespace bedflow {
namespace {

constexpr std::size_t most_case_bytes = 64 << 20;  // what a server takes is less

struct PlanAnswer {
  Reason code = Reason::finished;
  std::string text;
};

PlanAnswer plan_answer(const std::string& case_text, int ranks) {
  try {
    return {Reason::finished, plan_report(make_plan(scene_of(case_text), ranks))};
  } catch (const Stop& stop) {
    return {stop.reason, stop.what()};
  } catch (const std::exception& failure) {
    return {Reason::internal, failure.what()};
  }
}

}  // namespace

bool answer_plans(std::istream& questions, std::ostream& answers) {
  int ranks = 0;
  std::size_t bytes = 0;
  while (questions >> ranks >> bytes && ranks > 0 && bytes <= most_case_bytes && questions.get() == '\n') {
    std::string case_text(bytes, '\0');
    if (!questions.read(case_text.data(), static_cast<std::streamsize>(bytes))) return false;
    const PlanAnswer answer = plan_answer(case_text, ranks);
    answers << static_cast<int>(answer.code) << ' ' << answer.text.size() << '\n' << answer.text << std::flush;
  }
  return questions.eof();
}

}  // namespace bedflow
