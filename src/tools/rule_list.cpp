#include "tools/rule_list.h"

#include "backend/rules.h"

namespace dtsdf {

std::string listRules() {
  Rules rules;
  RuleLister lister;
  visitRules(rules, lister);
  return lister.text;
}

}  // namespace dtsdf
