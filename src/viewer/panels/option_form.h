// SPDX-License-Identifier: BSD-3-Clause
// A form for options that are described (base/option.h): a row for each that the command line
// offers too. Rows that do not matter at the current choices are hidden.
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
  // Options of the names in `without` get no row: the owner shows them in its own way.
  explicit OptionForm(std::vector<std::string> without = {}, QWidget* parent = nullptr);
  // Shows the values; the first call makes the rows. Later lists are of the same options.
  void Show(const OptionList& list);
  QFormLayout* form() const { return form_; }  // for rows of the owner's below these

 Q_SIGNALS:
  // By the user: the option at this place of the list wants this value, which may be refused.
  void edited(size_t index, const retint::OptionValue& value);

 private:
  void AddRow(const Option& option, size_t index);
  void ShowValue(QWidget* control, const Option& option);

  std::vector<std::string> without_;
  QFormLayout* form_;
  std::vector<QWidget*> controls_;  // one an option; null: it has no row
};

}  // namespace retint
