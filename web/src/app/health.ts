// The findings of `doppel check`, as published on /doppel/health.
export interface Finding {
  rule: string;
  severity: string;
  subject: string;
  message: string;
  file: string;
  line: number;
  column: number;
  fix: string;
  consequence: string;
}

export function readFindings(text: string): { findings: Finding[]; file: string; mass: number } | null {
  try {
    const raw = JSON.parse(text) as { findings?: Partial<Finding>[]; file?: string; mass?: number };
    const findings = (raw.findings ?? []).map((f) => ({
      rule: f.rule ?? '', severity: f.severity ?? 'note', subject: f.subject ?? '', message: f.message ?? '', file: f.file ?? '',
      line: f.line ?? 0, column: f.column ?? 0, fix: f.fix ?? '', consequence: f.consequence ?? '',
    }));
    const rank: Record<string, number> = { error: 0, warning: 1, note: 2 };
    findings.sort((a, b) => (rank[a.severity] ?? 3) - (rank[b.severity] ?? 3));
    return { findings, file: raw.file ?? '', mass: raw.mass ?? NaN };
  } catch {
    return null;
  }
}
