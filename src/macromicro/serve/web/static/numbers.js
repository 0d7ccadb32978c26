// Numbers as people type them: a comma is a point, and nothing else than a decimal number is one.

const NUMBER = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i;

// The number in a text, or NaN.
export function parsed(text) {
  const given = text.trim().replace(",", ".");
  return NUMBER.test(given) ? Number(given) : NaN;
}
