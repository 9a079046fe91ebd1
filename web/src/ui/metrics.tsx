// The metrics of a finished drill, as a table. Keys end in their units; those we do not know are shown as they are.
import type { Metrics } from "../contract/rest";

const kUnits: [string, string][] = [
  ["_mm3", "mm³"],
  ["_mm_per_s", "mm/s"],
  ["_mm", "mm"],
  ["_deg", "°"],
  ["_N", "N"],
  ["_s", "s"],
];

/** In the order in which they are shown; core/metrics/README.md says what they mean. */
const kNames: Record<string, string> = {
  entry_error_mm: "Entry off by",
  tip_error_mm: "Tip off by",
  angle_error_deg: "Angle off by",
  axial_angle_error_deg: "Axial angle off by",
  sagittal_angle_error_deg: "Sagittal angle off by",
  gertzbein_robbins: "Gertzbein-Robbins grade",
  breach_mm: "Breach",
  breach_direction: "Breach towards",
  plunge_mm: "Plunge past the bone",
  depth_max_mm: "Deepest",
  removed_mm3: "Bone removed",
  removed_outside_plan_mm3: "of it outside the plan",
  peak_thrust_N: "Peak thrust",
  mean_thrust_N: "Mean thrust",
  mean_feed_mm_per_s: "Mean feed",
  time_s: "Time",
};

/** Known, but said better by another. */
const kLeftOut = new Set(["removed", "cycles"]);

export interface MetricRow {
  key: string;
  name: string;
  value: string;
  unit: string;
}

export function metricRows(metrics: Metrics): MetricRow[] {
  const order = Object.keys(kNames);
  const place = (key: string): number => (order.includes(key) ? order.indexOf(key) : order.length);
  const sorted = Object.entries(metrics).sort(([a], [b]) => place(a) - place(b));
  return sorted.flatMap(([key, value]) => {
    if (value === null || typeof value === "object" || kLeftOut.has(key)) return [];
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
