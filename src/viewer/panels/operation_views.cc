// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/panels/operation_views.h"

#include <algorithm>
#include <string_view>

#include <QCoreApplication>

#include "kernels/common/color_spaces.h"
#include "recolor/tone.h"

namespace retint {
namespace {

using Kind = ColorOperationKind;

QString Tr(const char* text) { return QCoreApplication::translate("EditPanel", text); }

constexpr int kFirstPalette = 5;  // colors

constexpr ParameterView kViews[] = {
    {Kind::kRecolor, "keep_lightness", 0, "Keep lightness", 0, 1, 0.05, false, "",
     "How much of its lightness every pixel keeps: at 0 a dark color makes the object dark, at 1 "
     "only hue and saturation change"},
    {Kind::kTint, "color", 0, "Red", 0, 2, 0.05, false, "×", "What red is multiplied by"},
    {Kind::kTint, "color", 1, "Green", 0, 2, 0.05, false, "×", "What green is multiplied by"},
    {Kind::kTint, "color", 2, "Blue", 0, 2, 0.05, false, "×", "What blue is multiplied by"},
    {Kind::kAdjust, "hue", 0, "Hue", -180, 180, 1, false, "°", "Degrees that hues are turned by"},
    {Kind::kAdjust, "chroma", 0, "Chroma", 0, 3, 0.05, false, "×",
     "How much more colorful: 0 is gray, 1 changes nothing"},
    {Kind::kAdjust, "lightness", 0, "Lightness", 0, 2, 0.05, false, "×",
     "How much lighter: 0 is black, 1 changes nothing"},
    {Kind::kAdjust, "hues", 0, "Hues from", 0, 360, 1, false, "°",
     "Where the range of hues begins: red is near 29°, yellow 110°, green 142°, blue 264°"},
    {Kind::kAdjust, "hues", 1, "Hues to", 0, 360, 1, false, "°",
     "Where the range of hues ends; below its begin it goes through 0°"},
    {Kind::kAdjust, "hue_edge", 0, "Edge of hues", 0, 90, 1, false, "°",
     "Degrees over which the range of hues fades out"},
    {Kind::kAdjust, "chromas", 0, "Chroma from", 0, 0.4, 0.01, false, "",
     "Colors with less chroma are left alone; gray has 0"},
    {Kind::kAdjust, "chromas", 1, "Chroma to", 0, 0.4, 0.01, false, "",
     "Colors with more chroma are left alone; no screen shows more than 0.33"},
    {Kind::kAdjust, "lightnesses", 0, "Lightness from", 0, 1, 0.01, false, "",
     "Darker colors are left alone; black has 0"},
    {Kind::kAdjust, "lightnesses", 1, "Lightness to", 0, 1, 0.01, false, "",
     "Lighter colors are left alone; white has 1"},
    {Kind::kAdjust, "edge", 0, "Edge", 0, 0.3, 0.01, false, "",
     "Over how much chroma and lightness the range fades out"},
    {Kind::kExposure, "stops", 0, "Exposure", -4, 4, 0.1, false, " EV",
     "Stops: 1 doubles the light, -1 halves it"},
    {Kind::kContrast, "factor", 0, "Contrast", 0, 3, 0.05, false, "×",
     "Spreads the values about the pivot; 1 changes nothing"},
    {Kind::kContrast, "pivot", 0, "Pivot", 0, 1, 0.05, false, "",
     "The value that contrast leaves alone"},
    {Kind::kGamma, "gamma", 0, "Gamma", 0.25, 4, 0.05, true, "",
     "Above 1 the middle tones become brighter; black and white stay"},
    {Kind::kWhiteBalance, "temperature", 0, "Temperature", -100, 100, 1, false, "",
     "Above 0 the light is warmer, below 0 cooler (mired)"},
    {Kind::kWhiteBalance, "tint", 0, "Tint", -100, 100, 1, false, "",
     "Above 0 towards magenta, below 0 towards green"},
    {Kind::kSaturation, "factor", 0, "Saturation", 0, 3, 0.05, false, "×",
     "0 is gray, 1 changes nothing"},
    {Kind::kSoftClip, "knee", 0, "Knee", 0, 0.99, 0.05, false, "",
     "Above this share of the range colors are drawn in"},
};

constexpr Kind kGradeKinds[] = {Kind::kExposure,     Kind::kContrast,   Kind::kGamma,
                                Kind::kWhiteBalance, Kind::kSaturation, Kind::kInvert,
                                Kind::kGray,         Kind::kSoftClip};

QString Signed(float value) {
  const QString text = QString::number(double(value), 'g', 3);
  return value > 0 ? "+" + text : text;
}

QString Plain(float value) { return QString::number(double(value), 'g', 3); }

QString AdjustSummary(const ColorOperation& op) {
  QStringList parts;
  const auto add = [&](const char* parameter, float neutral, const QString& text) {
    if (op.Get(parameter)[0] != neutral) parts << text;
  };
  add("hue", 0, Tr("hue %1°").arg(Signed(op.Get("hue")[0])));
  add("chroma", 1, Tr("chroma ×%1").arg(Plain(op.Get("chroma")[0])));
  add("lightness", 1, Tr("lightness ×%1").arg(Plain(op.Get("lightness")[0])));
  return parts.isEmpty() ? QString() : parts.join(", ");
}

QString Detail(const ColorOperation& op) {
  switch (op.kind) {
    case Kind::kTint:
      return std::all_of(op.values.begin(), op.values.end(), [](float v) { return v <= 1; })
                 ? ToColor(op.values).name()
                 : QStringLiteral("%1, %2, %3")
                       .arg(Plain(op.values[0]), Plain(op.values[1]), Plain(op.values[2]));
    case Kind::kRecolor:
      return Tr("to %1").arg(ToColor(op.Get("to")).name());
    case Kind::kExposure:
      return Signed(op.values[0]);
    case Kind::kContrast:
    case Kind::kGamma:
    case Kind::kSaturation:
      return Plain(op.values[0]);
    case Kind::kWhiteBalance:
      return Signed(op.values[0]) + ", " + Signed(op.values[1]);
    case Kind::kAdjust:
      return AdjustSummary(op);
    case Kind::kGradient:
      return Tr("of %1 colors").arg(op.values.size() / 4);
    case Kind::kPalette:
      return op.values.size() == kPairValues
                 ? Tr("of 1 color")
                 : Tr("of %1 colors").arg(op.values.size() / kPairValues);
    case Kind::kPicture: {
      QStringList views;
      for (const EditedPicture& one : op.picture->pictures) {
        views << QString::fromStdString(one.view);
      }
      return Tr("of %1").arg(views.join(", "));
    }
    case Kind::kLut:
      return op.table ? QString::fromStdString(op.table->name) : QString();
    default:
      return {};
  }
}

}  // namespace

const ColorParameter& ParameterView::type() const {
  const std::span<const ColorParameter> parameters = TypeOf(kind).parameters;
  return *std::find_if(parameters.begin(), parameters.end(), [&](const ColorParameter& one) {
    return std::string_view(one.name) == parameter;
  });
}

float ParameterView::Get(const ColorOperation& operation) const {
  return std::min(operation.Get(parameter)[index], float(most()));
}

void ParameterView::Set(ColorOperation& operation, double value) const {
  operation.Get(parameter)[index] = HasOpenEnd() && value >= high ? type().max : float(value);
}

bool ParameterView::HasOpenEnd() const {
  const std::string_view name = parameter;
  return index == 1 && (name == "chromas" || name == "lightnesses");
}

double ParameterView::Default() const { return double(Get(ColorOperation::Make(kind))); }

std::span<const ParameterView> ParameterViews() { return kViews; }

std::span<const Kind> GradeKinds() { return kGradeKinds; }

QString OperationTitle(Kind kind) {
  if (kind == Kind::kLut) return Tr("LUT");
  QString name = QString(TypeOf(kind).name).replace('_', ' ');
  name[0] = name[0].toUpper();
  return Tr(qPrintable(name));
}

QString OperationTitle(const ColorOperation& operation) {
  const auto tone = Tone::Of(operation);
  if (!tone) return OperationTitle(operation.kind);
  return tone->kind == Tone::Kind::kCurve ? Tr("Curves") : Tr("Levels");
}

QString OperationSummary(const ColorOperation& operation) {
  const QString detail = Detail(operation), title = OperationTitle(operation);
  return detail.isEmpty() ? title : title + " " + detail;
}

ColorOperation NewOperation(Kind kind, const QColor& color) {
  const float rgb[3] = {color.redF(), color.greenF(), color.blueF()};
  switch (kind) {
    case Kind::kRecolor:
      return ColorOperation::Make(kind, {rgb[0], rgb[1], rgb[2]});
    case Kind::kMatrix:
      return ColorOperation::Make(kind, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
    case Kind::kGradient:
      return ColorOperation::Make(kind, {0, 0, 0, 0, 0.5F, rgb[0], rgb[1], rgb[2], 1, 1, 1, 1});
    case Kind::kPalette:
      return ColorOperation::Palette(kFirstPalette);
    default:
      return ColorOperation::Make(kind);
  }
}

void ForgetMeasured(ColorOperation& op) {
  if (op.kind == Kind::kRecolor && op.IsSet("brightest")) {  // unset: the user named the color
    std::ranges::fill(op.Get("from"), kUnset);
    op.Get("brightest")[0] = kUnset;
  }
  if (op.kind != Kind::kPalette) return;
  for (size_t i = 0; i + kPairValues <= op.values.size(); i += kPairValues) {
    std::fill_n(op.values.begin() + std::ptrdiff_t(i), 3, kUnset);
  }
}

bool TakeMeasured(ColorOperation& op, const ColorOperation& measured) {
  if (!op.NeedsMeasuring() || measured.kind != op.kind || measured.NeedsMeasuring()) return false;
  if (op.kind == Kind::kRecolor) {
    std::ranges::copy(measured.Get("from"), op.Get("from").begin());
    op.Get("brightest")[0] = measured.Get("brightest")[0];
    return true;
  }
  if (op.kind == Kind::kPicture) {
    const float strength = op.strength;
    op = measured;
    op.strength = strength;
    return true;
  }
  // Another number of colors is another palette.
  if (op.values.size() < measured.values.size()) return false;
  op.values.resize(measured.values.size());
  for (size_t i = 0; i < op.values.size(); i += kPairValues) {
    std::copy_n(measured.values.begin() + std::ptrdiff_t(i), 3,
                op.values.begin() + std::ptrdiff_t(i));
  }
  return true;
}

QColor ToColor(std::span<const float> values) {
  const auto part = [&](size_t c) { return std::clamp(values[c], 0.0F, 1.0F); };
  return QColor::fromRgbF(part(0), part(1), part(2));
}

QColor GrayOf(double lightness) {
  float rgb[3];
  SrgbFromOkLab({float(lightness), 0, 0}, rgb);
  return ToColor(rgb);
}

QColor Edited(const ColorEdit& edit, const QColor& base) {
  if (!base.isValid() || edit.NeedsMainColor()) return base;
  const Eigen::Vector3f color =
      CompiledEdit(edit).Apply(Eigen::Vector3f(base.redF(), base.greenF(), base.blueF()));
  return ToColor({color.data(), 3});
}

QColor NamedColor(const ColorEdit& edit) {
  if (edit.operations.empty()) return {};
  const ColorOperation& last = edit.operations.back();
  if (last.kind == Kind::kRecolor) return ToColor(last.Get("to"));
  if (last.kind == Kind::kTint && edit.operations.size() == 1) return ToColor(last.values);
  return {};
}

}  // namespace retint
