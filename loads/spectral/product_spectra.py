import numpy as np


def _cov(frequency, s):
    n=len(frequency); df=frequency[1]
    N=4*n
    two=np.zeros((N,)+s.shape[1:],complex)
    two[:n]=0.5*s; two[0]=0.5*s[0]
    two[N-n+1:]=0.5*np.conj(s[1:][::-1])
    two[0]=0.5*s[0].real  # f=0 counted: one-sided trapezoid half + half
    return np.fft.ifft(two,axis=0).real*N*df
def _back(r,frequency):
    n=len(frequency); df=frequency[1]; N=len(r)
    return 2*np.fft.fft(r,axis=0)[:n]/(N*df)
def product_spectrum(frequency, sg, a, sh=None):
    if sh is None:
        R=_cov(frequency,sg)
        t1=np.einsum('iab,tbc->tiac',a,R,optimize=True)
        RT=np.swapaxes(R,1,2)
        # 2 tr(A_i R A_j R^T)
        u=np.einsum('jab,tbc->tjac',a,RT,optimize=True)
        r=2*np.einsum('tiac,tjca->tij',t1,u,optimize=True)
    else:
        Rg=_cov(frequency,sg); Rh=_cov(frequency,sh)
        t1=np.einsum('iab,tbc->tiac',a,Rh,optimize=True)
        u=np.einsum('jba,tbc->tjac',a,np.swapaxes(Rg,1,2),optimize=True)
        r=np.einsum('tiac,tjca->tij',t1,u,optimize=True)
    return _back(r,frequency)
def square_spectrum(frequency, s, w):
    R=_cov(frequency,s)
    r=2*np.einsum('ia,tab,jb->tij',w,R*R,w,optimize=True)
    return _back(r,frequency)
