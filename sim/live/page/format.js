// Numbers as people read them.
export const kilobytes = (bytes) => (bytes / 1000).toLocaleString("en", { maximumFractionDigits: bytes < 1e5 ? 1 : 0 });
export const length = (value) => (value === undefined ? "–" : value.toFixed(3));
export const rate = (bytes) => (bytes === undefined ? "–" : kilobytes(bytes));
