// The metrics of a finished drill, as a table. Keys end in their units; those we do not know are shown as they are.
import type { Metrics } from "../contract/rest";

const kUnits: [string, string][] = [
  ["_mm3", "mm³"],
  ["_mm_s", "mm/s"],
  ["_mm", "mm"],
  ["_deg", "°"],
  ["_N", "N"],
  ["_s", "s"],
];

const kNames: Record<string, string> = {
  entry_error_mm: "Entry off by",
  tip_error_mm: "Tip off by",
  depth_mm: "Deepest",
  plunge_mm: "Past the target",
  removed_mm3: "Bone removed",
  removed_outside_plan_mm3: "of it outside the plan",
  outside_plan_mm3: "of it outside the plan",
  peak_thrust_N: "Peak thrust",
  mean_thrust_N: "Mean thrust",
  time_s: "Time",
  duration_s: "Time",
  axial_angle_deg: "Axial angle off by",
  sagittal_angle_deg: "Sagittal angle off by",
  angle_deg: "Angle off by",
};

export interface MetricRow {
  key: string;
  name: string;
  value: string;
  unit: string;
}

export function metricRows(metrics: Metrics): MetricRow[] {
  return Object.entries(metrics).flatMap(([key, value]) => {
    if (value === null || typeof value === "object") return [];
    const unit = kUnits.find(([ending]) => key.endsWith(ending));
    const stem = unit ? key.slice(0, -unit[0].length) : key;
    const plain = stem.replaceAll("_", " ");
    const name = kNames[key] ?? plain.charAt(0).toUpperCase() + plain.slice(1);
    return [{ key, name, value: valueText(value), unit: unit?.[1] ?? "" }];
  });
}

function valueText(value: unknown): string {
  if (typeof value !== "number") return typeof value === "boolean" ? (value ? "yes" : "no") : String(value);
  if (Number.isInteger(value)) return value.toLocaleString("en");
  return Math.abs(value) >= 100 ? value.toFixed(0) : value.toFixed(2);
}

export function MetricsTable({ metrics }: { metrics: Metrics }) {
  return (
    <table class="metrics">
      <caption class="hidden">Metrics of this drill</caption>
      <tbody>
        {metricRows(metrics).map((row) => (
          <tr key={row.key} data-metric={row.key}>
            <th scope="row">{row.name}</th>
            <td class="number">{row.value}</td>
            <td class="unit">{row.unit}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}
