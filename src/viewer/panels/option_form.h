// SPDX-License-Identifier: BSD-3-Clause
// A form for described options (base/option.h): one row for each option that the command line has.
// It hides rows without effect at the current choices.
#pragma once

#include <string>
#include <vector>

#include <QWidget>

#include "base/option.h"

class QFormLayout;

namespace retint {

class OptionForm : public QWidget {
  Q_OBJECT

 public:
  // Options in `without` get no row: the owner shows them itself.
  explicit OptionForm(std::vector<std::string> without = {}, QWidget* parent = nullptr);
  // Shows the values. The first call makes the rows; later lists must have the same options.
  void Show(const OptionList& list);
  QFormLayout* form() const { return form_; }  // for more rows of the owner, below these

 Q_SIGNALS:
  // By the user: the option at this index of the list should get this value. It may be refused.
  void edited(size_t index, const retint::OptionValue& value);

 private:
  void AddRow(const Option& option, size_t index);
  void ShowValue(QWidget* control, const Option& option);

  std::vector<std::string> without_;
  QFormLayout* form_;
  std::vector<QWidget*> controls_;  // one per option; null: no row
};

}  // namespace retint
