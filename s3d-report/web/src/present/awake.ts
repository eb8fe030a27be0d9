// Keeps the screen on, where the browser can.

export class Awake {
  private lock: WakeLockSentinel | null = null;
  private wanted = false;
  private readonly back = (): void => void this.take();

  constructor() {
    document.addEventListener("visibilitychange", this.back);
  }

  keep(on: boolean): void {
    this.wanted = on;
    if (on) void this.take();
    else this.drop();
  }

  close(): void {
    this.keep(false);
    document.removeEventListener("visibilitychange", this.back);
  }

  /** A browser takes the lock away from a page that is not seen, so it is asked for again. */
  private async take(): Promise<void> {
    if (!this.wanted || this.lock || document.visibilityState !== "visible") return;
    // Without it the screen may go off: nobody has to be told.
    const lock = await navigator.wakeLock?.request("screen").catch(() => null);
    if (!lock) return;
    this.lock = lock;
    lock.addEventListener("release", () => {
      if (this.lock === lock) this.lock = null;
    });
    if (!this.wanted) this.drop();
  }

  private drop(): void {
    const { lock } = this;
    this.lock = null;
    void lock?.release().catch(() => {});
  }
}
